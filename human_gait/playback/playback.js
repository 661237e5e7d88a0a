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
const LITTLE_MOTION = matchMedia("(prefers-reduced-motion: reduce)");

const viewer = startedViewer();
const dome = skyDome();
const walkers = data.walks.map(walkerOf);
const state = {
  phase: 0, strides: 0, speed: 1, view: "oblique", home: "oblique", overlay: data.overlay, torques: false,
  playing: !LITTLE_MOTION.matches,
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
  const [columns, rows] = grid(width >= height);
  return walkers.map((walker, k) => ({
    x: k % columns * width / columns, y: (rows - 1 - Math.floor(k / columns)) * height / rows,
    width: width / columns, height: height / rows, walkers: [walker],
  }));
}

// How many walkers stand beside and how many above each other.
function grid(broad) {
  const most = walkers.length > 3 ? Math.ceil(walkers.length / 2) : walkers.length;
  const other = Math.ceil(walkers.length / most);
  return broad ? [most, other] : [other, most];
}

viewer.render = () => draw(inMotion() ? quality.level : 0);

function draw(level) {
  viewer.controls.update();
  setQuality(level);
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
}

viewer.set_3d_pane_size = () => {
  const { clientWidth, clientHeight } = element("meshcat-pane");
  if (!clientWidth || !clientHeight) return;
  viewer.renderer.setSize(clientWidth, clientHeight);
  const stage = element("stage").classList;
  stage.toggle("across", clientWidth >= clientHeight);
  stage.toggle("down", clientWidth < clientHeight);
  const [columns, rows] = grid(clientWidth >= clientHeight);
  element("stage").style.setProperty("--columns", columns);
  element("stage").style.setProperty("--rows", rows);
  if (state.view) fitView();
  viewer.set_dirty();
};

function fitView() {
  const { from, width, height } = VIEWS[state.view];
  const { camera, controls } = viewer;
  const half = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  const pane = panes()[0];
  const scale = data.height / 1.75;
  const widest = Math.max(width * scale, 1.15 * data.broad[state.view]);
  const distance = Math.max(height * scale, widest * pane.height / pane.width) / (2 * half);
  camera.position.set(...from).setLength(distance);
  controls.target.set(0, 0, 0);
  controls.update();
  viewer.set_dirty();
}
