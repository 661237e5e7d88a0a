"use strict";
// Plays one walk or two in MeshCat's viewer. The phase of the stride, 0 to 1, is the only clock: it
// is the time of all animation tracks, whatever the pace of a walk.

const { THREE } = MeshCat;
const data = JSON.parse(document.getElementById("data").textContent);
const element = id => document.getElementById(id);
const all = selector => [...document.querySelectorAll(selector)];

const THEMES = {
  light: { sky: "#a9c8e4", haze: "#e9edef", ground: "#dedbd4", tile: "#d1cdc4" },
  dark: { sky: "#0b0f15", haze: "#2a333e", ground: "#545a62", tile: "#4a5058" },
};
const VIEWS = { // from where, and what must fit in, [m] of a person of 1.75 m
  side: { from: [0, 0.06, 1], width: 1.8, height: 2.15 },
  front: { from: [1, 0.06, 0], width: 1.5, height: 2.3 },
  top: { from: [0, 1, 0.001], width: 3.2, height: 2.2 },
  oblique: { from: [0.51, 0.14, 0.85], width: 1.8, height: 2.2 },
};
const GHOST = { colour: 0x8a63c9, opacity: 0.5 };
const DOME = 80; // radius of the sky, [m]
const NO_JOINT = "#9aa0a6"; // the pelvis hangs on no joint
const FRAME = 0.01; // of the stride, for the arrow keys
const EMBEDDED = window.self !== window.top; // in a report

const viewer = startedViewer();
const dome = skyDome();
const walkers = data.walks.map(walkerOf);
const state = {
  phase: 0, strides: 0, speed: 1, view: "oblique", overlay: data.overlay, torques: false,
  playing: !matchMedia("(prefers-reduced-motion: reduce)").matches,
};

function startedViewer() {
  try {
    return new MeshCat.Viewer(element("meshcat-pane"), false);
  } catch (error) {
    element("meshcat-pane").textContent = "This browser cannot draw in three dimensions (WebGL).";
    throw error;
  }
}

// ---- The walkers -------------------------------------------------------------------------------

function walkerOf(walk, k) {
  if (k === 0) build();
  const root = viewer.scene_tree.find(["human_gait", data.nodes[k]]);
  const path = root.children.path;
  const parts = { body: [], backpack: [] };
  const painted = [];
  for (const [joint, node] of Object.entries(path.children.body.children))
    for (const [name, part] of Object.entries(node.children)) {
      const group = name === "backpack" ? "backpack" : "body";
      parts[group].push(part.object);
      part.object.traverse(mesh => mesh.isMesh && (mesh.userData.colour = mesh.material.color.getHex()));
      if (!/^(eye|backpack)/.test(name))
        part.object.traverse(mesh => mesh.isMesh && painted.push({ mesh, torque: walk.torques[joint] }));
    }
  const layers = { ...parts };
  for (const name of ["ground", "footholds", "support", "zmp", "ground_reaction"])
    layers[name] = [path.children[name].object];
  return { ...walk, root: root.object, layers, painted, veils: [] };
}

function build() {
  for (const command of data.commands)
    viewer.handle_command_bytearray(Uint8Array.from(atob(command), c => c.charCodeAt(0)));
  viewer.animator.play(); // the tracks count from here on; the clock is ours
  viewer.animator.pause();
}

function meshes(objects) {
  const found = [];
  for (const object of objects) object.traverse(mesh => mesh.isMesh && !mesh.userData.veil && found.push(mesh));
  return found;
}

// A translucent body shows its surface only: its depth is drawn first, without colour.
function setGhost(walker, on) {
  const bodies = meshes([...walker.layers.body, ...walker.layers.backpack]);
  if (on && !walker.veils.length)
    walker.veils = bodies.map(mesh => {
      const material = new THREE.MeshBasicMaterial({ colorWrite: false, transparent: true });
      const veil = new THREE.Mesh(mesh.geometry, material);
      veil.userData.veil = true;
      veil.renderOrder = 1;
      mesh.add(veil);
      return veil;
    });
  for (const veil of walker.veils) veil.visible = on;
  for (const mesh of bodies) {
    mesh.castShadow = !on;
    mesh.renderOrder = on ? 2 : 0;
    soften(mesh.material, on ? GHOST.opacity : 1);
  }
  for (const mesh of meshes(walker.layers.footholds)) soften(mesh.material, on ? 0.45 : 1);
  for (const mesh of meshes([...walker.layers.zmp, ...walker.layers.ground_reaction]))
    mesh.material.opacity = on ? 0.4 : 0.85;
  for (const mesh of meshes(walker.layers.support)) mesh.material.opacity = on ? 0.4 : 0.75;
  for (const ground of walker.layers.ground) ground.visible = !on;
}

function soften(material, opacity) {
  material.transparent = opacity < 1;
  material.opacity = opacity;
  material.needsUpdate = true;
}

// ---- Colours -----------------------------------------------------------------------------------

const RAMP = data.ramp.map(colour => new THREE.Color(colour));

function ramp(share, target) {
  const place = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
  const below = Math.min(Math.floor(place), RAMP.length - 2);
  return target.copy(RAMP[below]).lerp(RAMP[below + 1], place - below);
}

function between(values, phase) {
  const place = phase * (values.length - 1);
  const below = Math.min(Math.floor(place), values.length - 2);
  return values[below] + (place - below) * (values[below + 1] - values[below]);
}

function paintTorques() {
  for (const walker of walkers)
    for (const { mesh, torque } of walker.painted)
      if (torque) ramp(between(torque, state.phase) / data.torqueMax, mesh.material.color);
      else mesh.material.color.set(NO_JOINT);
}

function paintClothes() {
  walkers.forEach((walker, k) => {
    for (const mesh of meshes([...walker.layers.body, ...walker.layers.backpack]))
      mesh.material.color.setHex(k && state.overlay ? GHOST.colour : mesh.userData.colour);
  });
  if (state.torques) paintTorques();
}

function paintStage() {
  const theme = THEMES[matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"];
  const [sky, haze] = [new THREE.Color(theme.sky), new THREE.Color(theme.haze)];
  viewer.scene.background = haze;
  viewer.scene.fog = new THREE.Fog(haze, 9, 34);
  const { position, color } = dome.geometry.attributes;
  for (let k = 0; k < position.count; k++) {
    const height = Math.max(position.getY(k) / DOME, 0); // sine of the elevation
    const shade = haze.clone().lerp(sky, Math.min(2.5 * height, 1));
    color.setXYZ(k, shade.r, shade.g, shade.b);
  }
  color.needsUpdate = true;
  for (const walker of walkers)
    for (const mesh of meshes(walker.layers.ground))
      mesh.material.color.set(mesh.parent.name === "plane" ? theme.ground : theme.tile);
  viewer.set_dirty();
}

// The sky: haze at the horizon, into which the ground fades.
function skyDome() {
  const geometry = new THREE.SphereGeometry(DOME, 16, 64);
  const colours = new Float32Array(3 * geometry.attributes.position.count);
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  const looks = { vertexColors: true, side: THREE.BackSide, fog: false, depthTest: false, depthWrite: false };
  const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(looks));
  mesh.renderOrder = -1;
  mesh.rotation.x = Math.PI / 2; // MeshCat's z points up
  viewer.scene.add(mesh);
  return mesh;
}

// ---- Drawing -----------------------------------------------------------------------------------

function panes() {
  const { clientWidth: width, clientHeight: height } = element("meshcat-pane");
  const whole = { x: 0, y: 0, width, height };
  if (walkers.length === 1 || state.overlay) return [{ ...whole, walkers }];
  return walkers.map((walker, k) => width >= height
    ? { x: k * width / 2, y: 0, width: width / 2, height, walkers: [walker] }
    : { x: 0, y: (1 - k) * height / 2, width, height: height / 2, walkers: [walker] });
}

viewer.render = () => {
  viewer.controls.update();
  viewer.renderer.setScissorTest(true);
  for (const pane of panes()) {
    const frame = [pane.x, pane.y, pane.width, pane.height];
    viewer.renderer.setViewport(...frame);
    viewer.renderer.setScissor(...frame);
    for (const walker of walkers) walker.root.visible = pane.walkers.includes(walker);
    viewer.camera.aspect = pane.width / pane.height;
    viewer.camera.updateProjectionMatrix();
    viewer.renderer.render(viewer.scene, viewer.camera);
  }
  viewer.needs_render = false;
};

viewer.set_3d_pane_size = () => {
  const { clientWidth, clientHeight } = element("meshcat-pane");
  if (!clientWidth || !clientHeight) return;
  viewer.renderer.setSize(clientWidth, clientHeight);
  const stage = element("stage").classList;
  stage.toggle("across", clientWidth >= clientHeight);
  stage.toggle("down", clientWidth < clientHeight);
  if (state.view) fitView();
  viewer.set_dirty();
};

function fitView() {
  const { from, width, height } = VIEWS[state.view];
  const { camera, controls } = viewer;
  const half = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  const pane = panes()[0];
  const distance = Math.max(height, width * pane.height / pane.width) / (2 * half);
  camera.position.set(...from).setLength(distance * data.stature / 1.75);
  controls.target.set(0, 0, 0);
  controls.update();
  viewer.set_dirty();
}

// ---- Controls ----------------------------------------------------------------------------------

function setView(name) {
  state.view = name;
  for (const button of all("#views button"))
    button.setAttribute("aria-pressed", button.dataset.view === name);
  if (name) fitView();
}

function setOverlay(overlay) {
  state.overlay = overlay;
  for (const button of all("#arrangements button"))
    button.setAttribute("aria-pressed", (button.dataset.overlay === "yes") === overlay);
  const stage = element("stage").classList;
  stage.toggle("laid", walkers.length > 1 && overlay);
  stage.toggle("apart", walkers.length > 1 && !overlay);
  if (walkers.length > 1) setGhost(walkers[1], overlay);
  paintClothes();
  viewer.set_3d_pane_size();
}

function setLayer(name, shown) {
  if (name === "torques") {
    state.torques = shown;
    element("torque-legend").hidden = !shown;
    paintClothes();
  } else
    for (const walker of walkers)
      for (const object of walker.layers[name]) object.visible = shown;
  viewer.set_dirty();
}

function setSpeed(speed) {
  state.speed = Math.min(2, Math.max(0.1, Math.round(10 * speed) / 10));
  element("speed").value = state.speed;
  element("speed-said").value = `${state.speed.toFixed(1)}×`;
}

function setPlaying(playing) {
  state.playing = playing;
  document.body.classList.toggle("playing", playing);
  element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
}

function seek(phase) {
  state.phase = phase - Math.floor(phase);
  viewer.animator.seek(state.phase);
  if (state.torques) paintTorques();
  tellTime();
}

function tellTime() {
  const percent = 100 * state.phase;
  const shown = String(Math.floor(percent)).padStart(2, "\u2007"); // as wide as a digit
  const seconds = walkers.map(walker => (state.phase * walker.strideTime).toFixed(2) + " s");
  const time = [...new Set(seconds)].join(" | ");
  element("clock").innerHTML = `<b>${time}</b> &ensp;${shown} % <span>of the stride</span>`;
  const scrub = element("scrub");
  scrub.value = percent;
  scrub.setAttribute("aria-valuetext", `${time}, ${Math.floor(percent)} % of the stride`);
}

function advance(seconds) {
  const phase = state.phase + state.speed * seconds / walkers[0].strideTime;
  state.strides += Math.floor(phase);
  const done = data.strides !== null && state.strides >= data.strides;
  seek(done ? 0 : phase);
  if (done) setPlaying(false);
}

function togglePlaying() {
  if (!state.playing) state.strides = 0;
  setPlaying(!state.playing);
}

const KEYS = {
  " ": togglePlaying,
  ArrowLeft: () => scrubTo(state.phase - FRAME),
  ArrowRight: () => scrubTo(state.phase + FRAME),
  ArrowUp: () => setSpeed(state.speed + 0.1),
  ArrowDown: () => setSpeed(state.speed - 0.1),
  ...Object.fromEntries(Object.keys(VIEWS).map((name, k) => [String(k + 1), () => setView(name)])),
};

function scrubTo(phase) {
  setPlaying(false);
  seek(phase);
}

function press(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in KEYS)) return;
  // Who walks through the controls with the tab key expects their own keys there.
  const own = event.target.matches("button, input") && event.target.matches(":focus-visible");
  if (own && !"1234".includes(event.key)) return;
  event.preventDefault();
  KEYS[event.key]();
}

// In a report the wheel scrolls the report; zooming needs Ctrl, as it does in maps.
function wheel(event) {
  if (EMBEDDED && !event.ctrlKey) event.stopPropagation();
}

// What the mouse has pressed lets go of the keyboard: space plays, whatever was clicked last.
function release(event) {
  if (event.detail > 0) document.activeElement.blur();
}

function drawContacts() {
  const overlap = 100 * data.walks[0].doubleSupport;
  const bars = {
    right: `linear-gradient(90deg, ${data.colours.right} ${50 + overlap}%, transparent 0)`,
    left: `linear-gradient(90deg, ${data.colours.left} ${overlap}%, transparent 0 50%, ${data.colours.left} 0)`,
  };
  for (const [side, bar] of Object.entries(bars)) {
    element(`contact-${side}`).style.background = bar;
    element(`contact-${side}`).setAttribute("aria-label", `When the ${side} foot stands`);
  }
}

function listen() {
  element("play").addEventListener("click", togglePlaying);
  element("scrub").addEventListener("input", event => scrubTo(Math.min(event.target.value / 100, 0.999999)));
  element("speed").addEventListener("input", event => setSpeed(Number(event.target.value)));
  for (const button of all("#views button"))
    button.addEventListener("click", () => setView(button.dataset.view));
  for (const button of all("#arrangements button"))
    button.addEventListener("click", () => setOverlay(button.dataset.overlay === "yes"));
  for (const box of all("#layers input"))
    box.addEventListener("change", () => setLayer(box.dataset.layer, box.checked));
  element("meshcat-pane").addEventListener("wheel", wheel, { capture: true, passive: true });
  viewer.controls.addEventListener("start", () => setView(null)); // turned by hand
  document.addEventListener("keydown", press);
  document.addEventListener("click", release);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paintStage);
  new ResizeObserver(viewer.set_3d_pane_size).observe(element("meshcat-pane"));
}

function start() {
  const canvas = viewer.renderer.domElement;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${document.title}: a person walks, seen in three dimensions`);
  const sun = viewer.scene_tree.find(["Lights", "Sun", "<object>"]).object;
  sun.shadow.normalBias = 0.02; // [m]; rounded parts would shade themselves in stripes
  viewer.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  for (const walker of walkers)
    for (const mesh of meshes([...walker.layers.zmp, ...walker.layers.ground_reaction]))
      Object.assign(mesh, { renderOrder: 3, castShadow: false });
  for (const walker of walkers)
    for (const flat of ["ground", "support", "footholds"])
      for (const mesh of meshes(walker.layers[flat])) mesh.castShadow = false;
  element("torque-legend").querySelector("div").style.background =
    `linear-gradient(90deg, ${data.ramp.join(", ")})`;
  element("torque-legend").querySelector("span").textContent = `0 to ${data.torqueMax} N m`;
  if (EMBEDDED) element("zoom").textContent = "Ctrl + wheel: zoom";
  drawContacts();
  listen();
  paintStage();
  setView(state.view);
  setOverlay(state.overlay);
  setPlaying(state.playing);
  setSpeed(1);
  seek(0);
}

let last = performance.now();
function frame(now) {
  requestAnimationFrame(frame);
  const seconds = Math.min((now - last) / 1000, 0.5); // the page may have been out of sight
  last = now;
  if (state.playing) advance(Math.max(seconds, 0));
  if (viewer.needs_render) viewer.render();
}

start();
requestAnimationFrame(frame);
