// A pen that draws with the calls of a canvas, and writes them as an SVG. It knows
// those calls that the layers of the picture use.

/** @param {number} value */
const tidy = (value) => String(Math.round(value * 100) / 100);

/** @param {string} text */
export const escaped = (text) =>
  text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;")
    .replaceAll('"', "&quot;");

export class SvgPen {
  fillStyle = "#000";
  strokeStyle = "#000";
  lineWidth = 1;
  globalAlpha = 1;
  font = "12px sans-serif";
  textAlign = "left";
  imageSmoothingEnabled = true;
  path = "";
  dash = "";
  move = { x: 0, y: 0, across: 1, along: 1 };
  /** @type {SvgPen["move"][]} */
  kept = [];
  /** @type {string[]} */
  parts = [];

  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.canvas = { width, height };
  }

  save() {
    this.kept.push({ ...this.move });
  }

  restore() {
    this.move = this.kept.pop() ?? this.move;
  }

  // The picture is drawn in its own units, whatever the screen has.
  setTransform() {
    this.move = { x: 0, y: 0, across: 1, along: 1 };
  }

  /** @param {number} x @param {number} y */
  translate(x, y) {
    this.move.x += x * this.move.across;
    this.move.y += y * this.move.along;
  }

  /** @param {number} across @param {number} along */
  scale(across, along) {
    this.move.across *= across;
    this.move.along *= along;
  }

  /** @param {number[]} dash */
  setLineDash(dash) {
    this.dash = dash.join(" ");
  }

  beginPath() {
    this.path = "";
  }

  closePath() {
    this.path += "Z";
  }

  /** @param {number} x @param {number} y */
  moveTo(x, y) {
    this.path += `M${tidy(x)} ${tidy(y)}`;
  }

  /** @param {number} x @param {number} y */
  lineTo(x, y) {
    this.path += `${this.path ? "L" : "M"}${tidy(x)} ${tidy(y)}`;
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  rect(x, y, width, height) {
    this.moveTo(x, y);
    this.path += `h${tidy(width)}v${tidy(height)}h${tidy(-width)}Z`;
  }

  // As two arcs: one cannot be a whole circle.
  /**
   * @param {number} x
   * @param {number} y
   * @param {number} radius
   * @param {number} from
   * @param {number} to
   */
  arc(x, y, radius, from, to) {
    for (const [place, angle] of [from, (from + to) / 2, to].entries()) {
      const [endX, endY] = [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
      if (place === 0) {
        if (this.path && !this.path.endsWith("Z") && to - from < 2 * Math.PI) {
          this.lineTo(endX, endY);
        } else this.moveTo(endX, endY);
      } else {
        const size = tidy(radius);
        const large = (to - from) / 2 > Math.PI ? 1 : 0;
        this.path += `A${size} ${size} 0 ${large} 1 ${tidy(endX)} ${tidy(endY)}`;
      }
    }
  }

  /** @param {CanvasFillRule} rule */
  fill(rule = "nonzero") {
    const fill = `fill="${this.fillStyle}" fill-rule="${rule}"`;
    this.put(`<path d="${this.path}" ${fill}${this.opacity}/>`);
  }

  stroke() {
    this.put(`<path d="${this.path}" ${this.line}${this.opacity}/>`);
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  fillRect(x, y, width, height) {
    this.put(`<rect ${box(x, y, width, height)} fill="${this.fillStyle}"/>`);
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  strokeRect(x, y, width, height) {
    this.put(`<rect ${box(x, y, width, height)} ${this.line}/>`);
  }

  /**
   * @param {HTMLCanvasElement} image
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  drawImage(image, x, y, width, height) {
    const { move } = this;
    const turned = `matrix(${move.across} 0 0 ${move.along} ${tidy(move.x)} ${
      tidy(move.y)
    })`;
    const sharp = 'preserveAspectRatio="none" style="image-rendering:pixelated"';
    this.put(
      `<image ${box(x, y, width, height)} transform="${turned}" ${sharp} href="${
        image.toDataURL("image/png")
      }"/>`,
    );
  }

  /** @param {string} text @param {number} x @param {number} y */
  fillText(text, x, y) {
    const [size, ...family] = this.font.split(" ");
    const letters = `font-size="${size}" font-family="${family.join(" ")}"`;
    const at = `x="${tidy(x)}" y="${tidy(y)}"`;
    this.put(
      `<text ${at} fill="${this.fillStyle}" ${letters}>${escaped(text)}</text>`,
    );
  }

  get opacity() {
    return this.globalAlpha < 1 ? ` opacity="${tidy(this.globalAlpha)}"` : "";
  }

  get line() {
    const dash = this.dash && ` stroke-dasharray="${this.dash}"`;
    const stroke = `stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}"`;
    return `fill="none" ${stroke}${dash}`;
  }

  /** @param {string} part */
  put(part) {
    this.parts.push(part);
  }

  // The drawing as a document, with a title and a description.
  /** @param {string} title @param {string} about */
  document(title, about) {
    const { width, height } = this.canvas;
    const size = `width="${width}" height="${height}" viewBox="0 0 ${width} ${height}"`;
    return [
      `<svg xmlns="http://www.w3.org/2000/svg" ${size}>`,
      `<title>${escaped(title)}</title>`,
      `<desc>${escaped(about)}</desc>`,
      ...this.parts,
      "</svg>\n",
    ].join("\n");
  }
}

/** @param {number} x @param {number} y @param {number} width @param {number} height */
const box = (x, y, width, height) =>
  `x="${tidy(x)}" y="${tidy(y)}" width="${tidy(width)}" height="${tidy(height)}"`;
