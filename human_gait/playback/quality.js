
// ---- Quality -----------------------------------------------------------------------------------
// What takes too long is left out, one thing after the other, while something moves: machines
// without a graphics card draw a whole frame in a quarter of a second. At rest shadows and
// resolution are back.

const LEVELS = [
  { shadows: true, smooth: true, share: 1 },
  { shadows: false, smooth: true, share: 1 },
  { shadows: false, smooth: false, share: 1 },
  { shadows: false, smooth: false, share: 0.5 }, // of the resolution
];
const SLOW = 50, QUICK = 25; // [ms] of a frame
const JUDGED = 5; // frames at once, by their median: one may be late for other reasons
const REST = 300; // [ms] after a movement
const SHARPNESS = Math.min(window.devicePixelRatio, 2);

const sun = viewer.scene_tree.find(["Lights", "Sun", "<object>"]).object;
const quality = {
  level: 0, drawn: 0, smooth: true, times: [], moved: -Infinity,
  since: 0, rose: false, patience: 4000, // [ms] until more is tried, longer if it was too much
};

function inMotion() {
  return state.playing || performance.now() - quality.moved < REST;
}

function judge(milliseconds) {
  quality.times.push(milliseconds);
  if (quality.times.length < JUDGED) return;
  const typical = quality.times.sort((a, b) => a - b)[JUDGED >> 1];
  quality.times = [];
  const now = performance.now();
  const less = typical > SLOW && quality.level < LEVELS.length - 1;
  const more = typical < QUICK && quality.level > 0 && now - quality.since > quality.patience;
  if (!less && !more) return;
  if (less && quality.rose) quality.patience *= 2;
  Object.assign(quality, { level: quality.level + (less ? 1 : -1), rose: more, since: now });
  setSmooth(LEVELS[quality.level].smooth);
}

function setQuality(level) {
  if (quality.drawn === level) return;
  quality.drawn = level;
  sun.castShadow = LEVELS[level].shadows;
  viewer.renderer.setPixelRatio(SHARPNESS * LEVELS[level].share);
}

// Whether edges are smooth is settled when a canvas begins: it takes another one.
function setSmooth(smooth) {
  if (quality.smooth === smooth) return;
  quality.smooth = smooth;
  const old = viewer.renderer;
  const renderer = new THREE.WebGLRenderer({ antialias: smooth, alpha: true });
  Object.assign(renderer.shadowMap, { enabled: true, type: old.shadowMap.type });
  renderer.setPixelRatio(old.getPixelRatio());
  describe(renderer.domElement);
  old.domElement.replaceWith(renderer.domElement);
  old.dispose();
  old.forceContextLoss();
  viewer.renderer = renderer;
  viewer.set_3d_pane_size();
}

function describe(canvas) {
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${document.title}: a person walks, seen in three dimensions`);
}

// Paper has no canvas: what is in sight becomes a picture.
function drawStill() {
  draw(0);
  element("still").setAttribute("src", viewer.renderer.domElement.toDataURL());
}
