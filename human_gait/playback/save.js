
// ---- Saving ------------------------------------------------------------------------------------
// What is in sight as a picture, or one stride of it as a film where the browser can record one.

const FILMS = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];
const filmType = window.MediaRecorder && FILMS.find(type => MediaRecorder.isTypeSupported(type));
const sheet = document.createElement("canvas"); // the picture with what is written over it

function copyPicture(level) {
  draw(level);
  const picture = viewer.renderer.domElement;
  const pen = sheet.getContext("2d");
  pen.drawImage(picture, 0, 0, sheet.width, sheet.height);
  const scale = sheet.width / picture.clientWidth;
  pen.textBaseline = "top";
  pen.font = `600 ${16 * scale}px system-ui, sans-serif`;
  pen.fillStyle = "#20262d";
  if (walkers.length > 1 && !state.overlay)
    panes().forEach((pane, k) => pen.fillText(walkers[k].name,
      (pane.x + 12) * scale, sheet.height - (pane.y + pane.height - 12) * scale, pane.width * scale - 24 * scale));
  const warnings = [...new Set(walkers.map(walker => walker.warning).filter(Boolean))];
  warnings.forEach((warning, k) => {
    const top = sheet.height - 28 * scale * (warnings.length - k);
    pen.fillStyle = "#b3261e";
    pen.fillRect(0, top, sheet.width, 28 * scale);
    pen.fillStyle = "#fff";
    pen.fillText(warning, 12 * scale, top + 6 * scale, sheet.width - 24 * scale);
  });
}

function startSheet(level) {
  draw(level); // which settles the size
  const { width, height } = viewer.renderer.domElement;
  Object.assign(sheet, { width: width - width % 2, height: height - height % 2 });
  copyPicture(level);
}

function download(blob, suffix) {
  const link = document.createElement("a");
  const name = document.title.replace(/[^\p{L}\p{N} ._-]/gu, "_");
  Object.assign(link, { href: URL.createObjectURL(blob), download: `${name}.${suffix}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

function savePicture() {
  startSheet(0); // at its best
  sheet.toBlob(blob => download(blob, "png"), "image/png");
}

function saveFilm() {
  const before = { playing: state.playing, speed: state.speed };
  seek(0);
  startSheet(quality.level);
  const recorder = new MediaRecorder(sheet.captureStream(), { mimeType: filmType, videoBitsPerSecond: 8e6 });
  const parts = [];
  recorder.ondataavailable = event => parts.push(event.data);
  recorder.onstop = () => {
    element("save-film").disabled = false;
    setSpeed(before.speed);
    setPlaying(before.playing);
    download(new Blob(parts, { type: filmType }), /mp4/.test(filmType) ? "mp4" : "webm");
  };
  element("save-film").disabled = true;
  state.strides = 0;
  setSpeed(1);
  setPlaying(true);
  recorder.start();
  const record = () => {
    copyPicture(quality.level);
    if (state.playing && state.strides < 1) requestAnimationFrame(record);
    else recorder.stop();
  };
  requestAnimationFrame(record);
}

element("save").hidden = EMBEDDED; // a frame has no right to write files
element("save-film").hidden = !filmType;
element("save-picture").addEventListener("click", savePicture);
element("save-film").addEventListener("click", saveFilm);
