// A viewer for long signals: draws, for every pixel column, the least and the largest value that it spans.
"use strict";
(() => {
  // Okabe and Ito's palette, as in the figures
  const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"];
  const LEFT = 64, RIGHT = 10, TOP = 16, BOTTOM = 36, BETWEEN = 22, NONE = -32768;
  const MOST_ZOOM = 1e-3; // s across the window

  const integers = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer), out = new Int16Array(bytes.length / 2);
    for (let i = 0; i < out.length; i++) out[i] = view.getInt16(2 * i, true);
    return out;
  };

  // 1, 2 or 5 times a power of ten, so that about `count` of them fill the span
  const tickStep = (span, count) => {
    const rough = span / count, power = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].find((n) => n * power >= rough) * power;
  };
  const decimals = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const number = (value, digits) => value.toFixed(digits).replace("-", "\u2212");

  class Channel {
    constructor(data, colour) {
      Object.assign(this, { name: data.name, pane: data.pane, unit: data.unit, scale: data.scale, offset: data.offset });
      this.colour = colour;
      this.shown = true;
      this.levels = data.levels.map((level) => {
        const low = integers(level.low);
        const high = level.high ? integers(level.high) : low; // samples themselves where the level has no bins
        return { start: level.start, step: level.step, count: level.count, low, high, binned: high !== low };
      });
      const whole = this.levels[0];
      this.start = whole.start;
      this.end = whole.start + whole.step * whole.count;
    }

    // the finest level that holds all of the window, else the coarsest
    level(from, to) {
      const first = Math.max(from, this.start), last = Math.min(to, this.end);
      const holds = this.levels.filter((l) => l.start <= first && l.start + l.step * l.count >= last);
      return holds.length ? holds[holds.length - 1] : this.levels[0];
    }

    // least and largest value from bin a up to bin b, or null
    range(level, a, b) {
      let low = Infinity, high = -Infinity;
      for (let i = Math.max(a, 0); i < Math.min(b, level.count); i++) {
        if (level.low[i] === NONE) continue;
        if (level.low[i] < low) low = level.low[i];
        if (level.high[i] > high) high = level.high[i];
      }
      return low > high ? null : [low * this.scale + this.offset, high * this.scale + this.offset];
    }
  }

  class Viewer {
    constructor(root) {
      const data = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
      this.root = root;
      this.canvas = root.querySelector("canvas");
      this.output = root.querySelector("output");
      const colours = {};
      this.channels = data.channels.map((c) => {
        colours[c.pane] = (colours[c.pane] ?? -1) + 1;
        return new Channel(c, COLOURS[colours[c.pane] % COLOURS.length]);
      });
      this.marks = data.marks;
      this.panes = [...new Set(this.channels.map((c) => c.pane))];
      this.start = Math.min(...this.channels.map((c) => c.start));
      this.end = Math.max(...this.channels.map((c) => c.end));
      this.legend(root.querySelector(".legend"));
      this.listen();
      this.all();
    }

    legend(place) {
      for (const channel of this.channels) {
        const label = document.createElement("label"), box = document.createElement("input"), swatch = document.createElement("span");
        box.type = "checkbox";
        box.checked = true;
        box.addEventListener("change", () => { channel.shown = box.checked; this.draw(); });
        swatch.className = "swatch";
        swatch.style.background = channel.colour;
        label.append(box, swatch, document.createTextNode(channel.name)); // text, whatever the name holds
        place.append(label);
      }
    }

    listen() {
      const canvas = this.canvas;
      canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        this.zoom(1.0015 ** event.deltaY, this.timeAt(event.offsetX));
      }, { passive: false });
      let held = null;
      canvas.addEventListener("pointerdown", (event) => {
        held = { x: event.clientX, from: this.from, to: this.to };
        canvas.setPointerCapture(event.pointerId);
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!held) return;
        const shift = (held.x - event.clientX) / this.width * (held.to - held.from);
        this.show(held.from + shift, held.to + shift);
      });
      for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { held = null; });
      canvas.addEventListener("dblclick", () => this.all());
      canvas.addEventListener("keydown", (event) => {
        const span = this.to - this.from, middle = (this.from + this.to) / 2;
        const actions = {
          ArrowLeft: () => this.show(this.from - span / 10, this.to - span / 10),
          ArrowRight: () => this.show(this.from + span / 10, this.to + span / 10),
          "+": () => this.zoom(0.5, middle), "=": () => this.zoom(0.5, middle), "-": () => this.zoom(2, middle),
          Home: () => this.all(),
        };
        if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
        event.preventDefault();
        actions[event.key]();
      });
      for (const button of this.root.querySelectorAll("button")) {
        button.addEventListener("click", () => {
          const middle = (this.from + this.to) / 2;
          ({ in: () => this.zoom(0.5, middle), out: () => this.zoom(2, middle), all: () => this.all() })[button.dataset.do]();
        });
      }
      new ResizeObserver(() => this.draw()).observe(canvas);
    }

    get width() { return Math.max(1, this.canvas.clientWidth - LEFT - RIGHT); }
    timeAt(x) { return this.from + (x - LEFT) / this.width * (this.to - this.from); }
    xAt(time) { return LEFT + (time - this.from) / (this.to - this.from) * this.width; }
    all() { this.show(this.start, this.end); }
    zoom(factor, about) { this.show(about + (this.from - about) * factor, about + (this.to - about) * factor); }

    show(from, to) {
      const span = Math.min(Math.max(to - from, MOST_ZOOM), this.end - this.start);
      const middle = (from + to) / 2;
      this.from = Math.min(Math.max(middle - span / 2, this.start), this.end - span);
      this.to = this.from + span;
      const digits = decimals(span / 1000);
      this.output.textContent = `${number(this.from, digits)} s to ${number(this.to, digits)} s`;
      this.draw();
    }

    draw() {
      const ratio = window.devicePixelRatio || 1, canvas = this.canvas;
      canvas.width = Math.round(canvas.clientWidth * ratio);
      canvas.height = Math.round(canvas.clientHeight * ratio);
      const pen = canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
      pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
      const room = canvas.clientHeight - TOP - BOTTOM - BETWEEN * (this.panes.length - 1);
      const share = this.panes.length > 1 ? [0.7, 0.3 / (this.panes.length - 1)] : [1];
      let top = TOP;
      this.panes.forEach((pane, i) => {
        const height = room * share[Math.min(i, 1)];
        this.drawPane(pen, this.channels.filter((c) => c.pane === pane), top, height, i === this.panes.length - 1, i === 0);
        top += height + BETWEEN;
      });
    }

    drawPane(pen, channels, top, height, last, first) {
      // one range a pixel column; where samples or bins are further apart than pixels, one a sample or bin
      const shown = channels.filter((c) => c.shown), strokes = [];
      let low = Infinity, high = -Infinity;
      for (const channel of shown) {
        const level = channel.level(this.from, this.to), perPixel = (this.to - this.from) / this.width / level.step;
        const points = [];
        const a = Math.max(0, Math.floor((this.from - level.start) / level.step) - 1);
        const b = Math.min(level.count, Math.ceil((this.to - level.start) / level.step) + 2);
        const size = Math.max(1, perPixel);
        for (let at = Math.floor(a / size) * size; at < b; at += size) {
          const range = channel.range(level, Math.round(at), Math.max(Math.round(at) + 1, Math.round(at + size)));
          const middle = level.binned || size > 1 ? at + size / 2 : at;
          points.push({ x: this.xAt(level.start + middle * level.step), range });
          if (range) { low = Math.min(low, range[0]); high = Math.max(high, range[1]); }
        }
        strokes.push({ colour: channel.colour, points });
      }
      if (!(low <= high)) { low = 0; high = 1; }
      const margin = 0.06 * (high - low) || 0.5;
      low -= margin; high += margin;
      const yAt = (value) => top + height * (1 - (value - low) / (high - low));

      this.axes(pen, top, height, low, high, yAt, last);
      pen.fillStyle = "#333";
      pen.textAlign = "left";
      pen.fillText(`${channels[0].pane} [${channels[0].unit}]`, LEFT + 4, top - 4);
      pen.save();
      pen.beginPath();
      pen.rect(LEFT, top, this.width, height);
      pen.clip();
      for (const mark of this.marks) {
        const x = this.xAt(mark.at);
        pen.strokeStyle = "#999";
        pen.setLineDash([4, 3]);
        pen.beginPath(); pen.moveTo(x, top); pen.lineTo(x, top + height); pen.stroke();
        pen.setLineDash([]);
      }
      for (const { colour, points } of strokes) this.band(pen, colour, points, yAt);
      pen.restore();
      if (first) this.markNames(pen, top);
    }

    // the band between least and largest value, broken where there is none; a line where both are equal
    band(pen, colour, points, yAt) {
      pen.strokeStyle = pen.fillStyle = colour;
      pen.lineWidth = 1;
      let run = [];
      const finish = () => {
        if (run.length) {
          pen.beginPath();
          run.forEach(({ x, range }, i) => (i ? pen.lineTo(x, yAt(range[1])) : pen.moveTo(x, yAt(range[1]))));
          run.reverse().forEach(({ x, range }) => pen.lineTo(x, yAt(range[0])));
          pen.closePath();
          pen.fill();
          pen.stroke();
        }
        run = [];
      };
      for (const point of points) if (point.range) run.push(point); else finish();
      finish();
    }

    // names of the phases' beginnings; one that would run into the last is left out
    markNames(pen, top) {
      let free = LEFT;
      pen.fillStyle = "#666";
      pen.textAlign = "left";
      for (const mark of this.marks) {
        const x = this.xAt(mark.at) + 3;
        if (x < free || x > LEFT + this.width - 60) continue;
        pen.fillText(mark.name, x, top + 13);
        free = x + pen.measureText(mark.name).width + 8;
      }
    }

    axes(pen, top, height, low, high, yAt, last) {
      pen.strokeStyle = "#e4e4e4";
      pen.fillStyle = "#333";
      pen.lineWidth = 1;
      const stepY = tickStep(high - low, Math.max(3, height / 40));
      pen.textAlign = "right";
      pen.textBaseline = "middle";
      for (let v = Math.ceil(low / stepY) * stepY; v <= high; v += stepY) {
        const y = yAt(v);
        pen.beginPath(); pen.moveTo(LEFT, y); pen.lineTo(LEFT + this.width, y); pen.stroke();
        pen.fillText(number(Math.abs(v) < stepY / 1e6 ? 0 : v, decimals(stepY)), LEFT - 6, y);
      }
      const stepX = tickStep(this.to - this.from, Math.max(2, this.width / 110));
      pen.textAlign = "center";
      pen.textBaseline = "alphabetic";
      for (let t = Math.ceil(this.from / stepX) * stepX; t <= this.to; t += stepX) {
        const x = this.xAt(t);
        pen.beginPath(); pen.moveTo(x, top); pen.lineTo(x, top + height); pen.stroke();
        if (last) pen.fillText(number(Math.abs(t) < stepX / 1e6 ? 0 : t, decimals(stepX)), x, top + height + 15);
      }
      pen.strokeStyle = "#555";
      pen.strokeRect(LEFT, top, this.width, height);
      if (last) pen.fillText("time from the record's first sample [s]", LEFT + this.width / 2, top + height + 31);
    }
  }

  for (const root of document.querySelectorAll("[data-viewer]")) new Viewer(root);
})();
