// A 3-D view on a canvas that is turned by pointer and by keyboard.

// As the pictures of this package: z up, seen from the front left and a little from above.
const [AZIMUTH, ELEVATION] = [50, 18].map((degrees) => (degrees * Math.PI) / 180);
const FIRST_TURN = [
  -Math.sin(AZIMUTH), Math.cos(AZIMUTH), 0,
  -Math.sin(ELEVATION) * Math.cos(AZIMUTH), -Math.sin(ELEVATION) * Math.sin(AZIMUTH), Math.cos(ELEVATION),
  Math.cos(ELEVATION) * Math.cos(AZIMUTH), Math.cos(ELEVATION) * Math.sin(AZIMUTH), Math.sin(ELEVATION),
];
const KEY_ANGLE = Math.PI / 18;

// Turned to the right and downwards, by angles, as the viewer sees it.
function turned(turn, right, down) {
  const [c, s, d, e] = [Math.cos(right), Math.sin(right), Math.cos(down), Math.sin(down)];
  const rows = [turn.slice(0, 3), turn.slice(3, 6), turn.slice(6, 9)];
  const x = [0, 1, 2].map((k) => c * rows[0][k] + s * rows[2][k]), z = [0, 1, 2].map((k) => c * rows[2][k] - s * rows[0][k]);
  const y = [0, 1, 2].map((k) => d * rows[1][k] - e * z[k]), w = [0, 1, 2].map((k) => e * rows[1][k] + d * z[k]);
  return [...x, ...y, ...w];
}

class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.shown = null;
    this.reset();
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) this.turn((4 * event.movementX) / canvas.clientWidth, (4 * event.movementY) / canvas.clientWidth);
    });
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      this.magnify(Math.exp(-event.deltaY / 500));
    }, { passive: false });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // owner[i] is the part of the query that part i answers to; labels[i] what is written on it; only: one part, or null.
  show(surface, owner, labels, only) {
    if (this.shown && this.shown.surface !== surface) this.reset();
    this.shown = { surface, owner, labels, only };
    this.draw();
  }

  reset() {
    this.rotation = FIRST_TURN;
    this.zoom = 1;
  }

  turn(right, down) {
    this.rotation = turned(this.rotation, right, down);
    this.draw();
  }

  magnify(factor) {
    this.zoom = Math.min(8, Math.max(0.5, this.zoom * factor));
    this.draw();
  }

  key(event) {
    const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (turns) this.turn(...turns.map((k) => k * KEY_ANGLE));
    else if (event.key === "+" || event.key === "=") this.magnify(1.2);
    else if (event.key === "-") this.magnify(1 / 1.2);
    else if (event.key === "0") { this.reset(); this.draw(); }
    else return;
    event.preventDefault();
  }

  // Once a frame, however many events there are.
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    const size = 2 * Math.max(1, Math.min(480, this.canvas.clientWidth)), context = this.canvas.getContext("2d");
    if (this.canvas.width !== size) this.canvas.width = this.canvas.height = size;
    context.clearRect(0, 0, size, size);
    if (!this.shown || !this.shown.surface) return;
    const { surface, owner, labels, only } = this.shown;
    const tint = (part) => {
      const own = part < 0 || owner[part] === undefined ? -1 : owner[part];
      return [...colourOf(own), only === null || own === only ? (own < 0 ? 0.25 : 0.6) : 0];
    };
    const { image, places } = drawn(surface, this.rotation, this.zoom, size, tint);
    context.putImageData(image, 0, 0);
    const marks = places.map((place, i) => ({ ...place, text: labels[i] || "", own: owner[i] === undefined ? -1 : owner[i] }));
    for (const mark of marks.sort((a, b) => b.hidden - a.hidden || a.z - b.z))
      if (only === null || mark.own === only) label(context, mark, size);
  }
}

// A number in a disc of the part's colour; a part that is behind the surface is pale, one that nothing matched a dot.
function label(context, mark, size) {
  const height = mark.text ? Math.max(26, size / 28) : 10, colour = colourOf(mark.own);
  context.globalAlpha = mark.hidden ? 0.3 : 1;
  context.font = `600 ${0.62 * height}px system-ui, sans-serif`;
  const width = Math.max(height, context.measureText(mark.text).width + 0.6 * height);
  context.beginPath();
  context.roundRect(mark.x - width / 2, mark.y - height / 2, width, height, height / 2);
  context.fillStyle = css(colour);
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = "#fff";
  context.stroke();
  context.fillStyle = inkOn(colour);
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(mark.text, mark.x, mark.y + 1);
  context.globalAlpha = 1;
}

// A small picture without labels; every part in its own colour is too much at this size.
function thumbnail(canvas, surface) {
  const size = (canvas.width = canvas.height = 200);
  const tint = () => [110, 130, 150, surface.faces.length ? 0.35 : 1];
  surface.small ??= drawn(surface, FIRST_TURN, 1, size, tint).image;
  canvas.getContext("2d").putImageData(surface.small, 0, 0);
}
