// The matrix as an image: zoom, names of the pair under the pointer, cells chosen by keyboard.

// Anchors of cividis, whose lightness alone tells values apart (J. Nuñez, C. Anderton, R. Renslow, PLOS ONE 13(7), 2018).
const CIVIDIS = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"]
  .map((text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16)));

function cividis(share) {
  const at = share * (CIVIDIS.length - 1), k = Math.min(CIVIDIS.length - 2, Math.floor(at));
  return [0, 1, 2].map((c) => Math.round(CIVIDIS[k][c] + (at - k) * (CIVIDIS[k + 1][c] - CIVIDIS[k][c])));
}

const MARGIN = 84;

class Matrix {
  constructor(canvas, cellText, choose) {
    Object.assign(this, collection.matrix, { canvas, cellText, choose, cell: null });
    this.bytes = bytes(this.values);
    this.image = this.painted();
    this.all();
    const inside = (event, act) => { const cell = this.cellAt(event); if (cell) act(cell); };
    canvas.addEventListener("pointerdown", (event) => { this.start = event; this.moved = 0; });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => { if (this.start && this.moved < 5) inside(event, (cell) => { this.point(cell); this.enter(); }); this.start = null; });
    canvas.addEventListener("pointerleave", () => { this.start = null; });
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      inside(event, (cell) => this.zoom(Math.exp(-event.deltaY / 400), cell));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  painted() {
    const image = document.createElement("canvas"), context = image.getContext("2d");
    image.width = image.height = this.count;
    const pixels = context.createImageData(this.count, this.count);
    this.bytes.forEach((value, k) => { pixels.data.set([...cividis(value / 255), 255], 4 * k); });
    context.putImageData(pixels, 0, 0);
    return image;
  }

  all() { Object.assign(this, { left: 0, top: 0, span: this.count }); }

  // Zoom around a cell, by default the chosen one or the middle.
  zoom(factor, cell) {
    const about = cell || this.cell || { row: this.top + this.span / 2, column: this.left + this.span / 2 };
    const span = Math.min(this.count, Math.max(Math.min(2, this.count), this.span / factor));
    this.left = about.column - ((about.column - this.left) * span) / this.span;
    this.top = about.row - ((about.row - this.top) * span) / this.span;
    this.span = span;
    this.keepInside();
  }

  keepInside() {
    this.left = Math.min(this.count - this.span, Math.max(0, this.left));
    this.top = Math.min(this.count - this.span, Math.max(0, this.top));
    this.draw();
  }

  cellAt(event) {
    const side = this.canvas.clientWidth - this.margin();
    const column = Math.floor(this.left + ((event.offsetX - this.margin()) / side) * this.span);
    const row = Math.floor(this.top + ((event.offsetY - this.margin()) / side) * this.span);
    const fits = (k) => k >= 0 && k < this.count;
    return event.offsetX >= this.margin() && event.offsetY >= this.margin() && fits(row) && fits(column) ? { row, column } : null;
  }

  move(event) {
    if (this.start && event.buttons) {
      const perPixel = this.span / (this.canvas.clientWidth - this.margin());
      this.moved += Math.abs(event.movementX) + Math.abs(event.movementY);
      this.left -= event.movementX * perPixel;
      this.top -= event.movementY * perPixel;
      this.keepInside();
    } else {
      const cell = this.cellAt(event);
      if (cell) this.point(cell);
    }
  }

  point(cell) {
    this.cell = cell;
    const value = this.low + (this.bytes[cell.row * this.count + cell.column] / 255) * (this.high - this.low);
    this.cellText.textContent = `query ${this.named(cell.row)}\nobject ${this.named(cell.column)}\n` +
      (cell.row === cell.column && this.count === order.length ? "the object itself" : `dissimilarity ${short(value)}`);
    this.draw();
  }

  // The object of a row, or the first and the last of several.
  named(k) {
    const first = order[this.bounds[k]], last = order[this.bounds[k + 1] - 1];
    return first === last ? titled(first) : `${titled(first)} to ${titled(last)}`;
  }

  enter() {
    if (this.cell) this.choose(order[this.bounds[this.cell.row]], order[this.bounds[this.cell.column]]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (steps) this.step(...steps);
    else if (event.key === "+" || event.key === "=") this.zoom(1.5);
    else if (event.key === "-") this.zoom(1 / 1.5);
    else if (event.key === "0") { this.all(); this.draw(); }
    else if (event.key === "Enter") this.enter();
    else return;
    event.preventDefault();
  }

  step(down, right) {
    const within = (k) => Math.min(this.count - 1, Math.max(0, k));
    const from = this.cell || { row: Math.ceil(this.top) - down, column: Math.ceil(this.left) - right };
    const cell = { row: within(from.row + down), column: within(from.column + right) };
    this.top = Math.min(cell.row, Math.max(this.top, cell.row + 1 - this.span));
    this.left = Math.min(cell.column, Math.max(this.left, cell.column + 1 - this.span));
    this.point(cell);
  }

  margin() { return labelled ? Math.min(MARGIN, this.canvas.clientWidth / 5) : 0; }

  draw() {
    const width = this.canvas.clientWidth, ratio = Math.min(2, window.devicePixelRatio || 1), context = this.canvas.getContext("2d");
    if (!width) return;
    const pixels = Math.round(width * ratio);
    if (this.canvas.width !== pixels) this.canvas.width = this.canvas.height = pixels;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, width);
    const margin = this.margin(), side = width - margin, unit = side / this.span;
    context.save();
    context.beginPath();
    context.rect(margin, margin, side, side);
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(this.image, margin - this.left * unit, margin - this.top * unit, this.count * unit, this.count * unit);
    if (labelled) this.blocks(context, margin, side, unit);
    if (this.cell) this.outline(context, margin, unit);
    context.restore();
    if (labelled) this.classNames(context, margin, side, unit);
  }

  outline(context, margin, unit) {
    const [x, y] = [margin + (this.cell.column - this.left) * unit, margin + (this.cell.row - this.top) * unit];
    const grown = Math.max(unit, 7), off = (grown - unit) / 2;
    for (const [colour, wide] of [["#000", 4], ["#fff", 2]]) {
      context.strokeStyle = colour;
      context.lineWidth = wide;
      context.strokeRect(x - off, y - off, grown, grown);
    }
  }

  // Where the classes begin, and where the last one ends, in cells.
  starts() {
    const starts = [];
    let previous = -1;
    for (let k = 0; k < this.count; k++) {
      const own = classOf[order[this.bounds[k]]];
      if (own !== previous) starts.push({ cell: k, own });
      previous = own;
    }
    return [...starts, { cell: this.count, own: -1 }];
  }

  blocks(context, margin, side, unit) {
    context.strokeStyle = "rgba(255,255,255,.85)";
    const starts = this.starts();
    // Thin between many classes, whose cells they would hide.
    context.lineWidth = Math.min(1, Math.max(0.25, (this.count * unit) / starts.length / 16));
    for (const { cell } of starts.slice(1, -1)) {
      const [x, y] = [margin + (cell - this.left) * unit, margin + (cell - this.top) * unit];
      context.strokeRect(x, margin - 2, 0, side + 4);
      context.strokeRect(margin - 2, y, side + 4, 0);
    }
  }

  // Along both sides; names that would run into the one before are left out.
  classNames(context, margin, side, unit) {
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = "#566273";
    context.textBaseline = "middle";
    context.textAlign = "right";
    const starts = this.starts();
    for (const [origin, upright] of [[this.top, false], [this.left, true]]) {
      let free = -Infinity;
      starts.slice(0, -1).forEach(({ cell, own }, k) => {
        const [from, to] = [cell, starts[k + 1].cell].map((at) => Math.min(side, Math.max(0, (at - origin) * unit)));
        const middle = margin + (from + to) / 2;
        if (to - from < 1 || middle - 7 < free) return;
        free = middle + 7;
        context.save();
        if (upright) { context.translate(middle, margin - 6); context.rotate(Math.PI / 2); }
        else context.translate(margin - 6, middle);
        context.fillText(fitted(context, collection.classes[own], margin - 10), 0, 0);
        context.restore();
      });
    }
  }
}

function fitted(context, text, room) {
  if (context.measureText(text).width <= room) return text;
  let end = text.length;
  while (end > 1 && context.measureText(`${text.slice(0, end)}…`).width > room) end--;
  return `${text.slice(0, end)}…`;
}

function drawLegend(canvas) {
  const context = canvas.getContext("2d");
  for (let x = 0; x < canvas.width; x++) {
    context.fillStyle = css(cividis(x / (canvas.width - 1)));
    context.fillRect(x, 0, 1, canvas.height);
  }
}
