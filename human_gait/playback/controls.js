
// ---- Controls ----------------------------------------------------------------------------------

function setView(name) {
  state.view = name;
  state.home = name ?? state.home;
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

const TURN = Math.PI / 24, ZOOM = 1.1; // of one key
const KEYS = {
  " ": togglePlaying,
  ArrowLeft: () => scrubTo(state.phase - FRAME),
  ArrowRight: () => scrubTo(state.phase + FRAME),
  ArrowUp: () => setSpeed(state.speed + 0.1),
  ArrowDown: () => setSpeed(state.speed - 0.1),
};
const TURNS = { // the camera goes that way around the walker
  ArrowLeft: () => moveCamera(-TURN, 0, 1),
  ArrowRight: () => moveCamera(TURN, 0, 1),
  ArrowUp: () => moveCamera(0, -TURN, 1),
  ArrowDown: () => moveCamera(0, TURN, 1),
};
const EVERYWHERE = { // no control has these for itself
  ...Object.fromEntries(Object.keys(VIEWS).map((name, k) => [String(k + 1), () => setView(name)])),
  "+": () => moveCamera(0, 0, 1 / ZOOM),
  "=": () => moveCamera(0, 0, 1 / ZOOM), // plus without Shift
  "-": () => moveCamera(0, 0, ZOOM),
  "0": () => setView(state.home),
  "?": () => toggleHelp(),
};

function moveCamera(sideways, down, farther) {
  const { camera, controls } = viewer;
  const place = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
  place.theta += sideways;
  place.phi += down;
  place.radius = Math.min(Math.max(place.radius * farther, controls.minDistance), controls.maxDistance);
  camera.position.setFromSpherical(place.makeSafe()).add(controls.target);
  setView(null);
  quality.moved = performance.now();
  viewer.set_dirty();
}

function toggleHelp() {
  const help = element("help");
  if (help.open) help.close();
  else help.showModal();
}

function scrubTo(phase) {
  setPlaying(false);
  quality.moved = performance.now();
  seek(phase);
}

function press(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (element("help").open && event.key !== "?") return;
  const action = EVERYWHERE[event.key] ?? actionHere(event);
  if (!action) return;
  event.preventDefault();
  action();
}

// Who walks through the page with the tab key expects controls to have their own keys, and the
// arrows to turn the picture.
function actionHere({ key, shiftKey, target }) {
  const reached = target.matches(":focus-visible");
  if (reached && target.matches("button, input")) return undefined;
  return shiftKey || (reached && target.id === "meshcat-pane") ? TURNS[key] ?? KEYS[key] : KEYS[key];
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
  viewer.controls.addEventListener("start", () => { setView(null); quality.moved = Infinity; }); // by hand
  viewer.controls.addEventListener("end", () => (quality.moved = performance.now()));
  element("ask").addEventListener("click", toggleHelp);
  document.addEventListener("keydown", press);
  document.addEventListener("click", release);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paintStage);
  LITTLE_MOTION.addEventListener("change", () => LITTLE_MOTION.matches && setPlaying(false));
  window.addEventListener("beforeprint", drawStill);
  new ResizeObserver(viewer.set_3d_pane_size).observe(element("meshcat-pane"));
}

function start() {
  describe(viewer.renderer.domElement);
  sun.shadow.normalBias = 0.02; // [m]; rounded parts would shade themselves in stripes
  viewer.renderer.setPixelRatio(SHARPNESS);
  Object.assign(viewer.controls, { minDistance: 0.5, maxDistance: 30 }); // [m], within the sky
  // In a report a finger that goes up or down scrolls the report, as it does in maps.
  element("meshcat-pane").style.touchAction = EMBEDDED ? "pan-y" : "none";
  for (const walker of walkers)
    for (const mesh of meshes([...walker.layers.zmp, ...walker.layers.ground_reaction]))
      Object.assign(mesh, { renderOrder: 3, castShadow: false });
  for (const walker of walkers)
    for (const flat of ["ground", "support", "footholds"])
      for (const mesh of meshes(walker.layers[flat])) mesh.castShadow = false;
  element("torque-legend").querySelector("div").style.background =
    `linear-gradient(90deg, ${data.ramp.join(", ")})`;
  element("torque-legend").querySelector("span").textContent = `0 to ${data.torqueMax} N m`;
  if (EMBEDDED) for (const said of all(".zoom")) said.textContent = "Ctrl + wheel: zoom";
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
let moving = false, drew = false;
function frame(now) {
  requestAnimationFrame(frame);
  const passed = now - last;
  last = now;
  if (state.playing) advance(Math.min(Math.max(passed, 0), 500) / 1000); // or out of sight
  if (moving !== inMotion()) {
    moving = !moving;
    quality.times = [];
    viewer.set_dirty();
  } else if (moving && drew) judge(passed); // it took the frame before so long
  drew = viewer.needs_render;
  if (drew) viewer.render();
}

start();
requestAnimationFrame(frame);
