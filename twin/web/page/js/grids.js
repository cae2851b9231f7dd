/** Grids under the map: in tiles from the server of the page, or, where it has none, whole by rosbridge. */

const LOOK_MS = 1000; // how often it is asked what has changed, of a grid that is drawn
const AGAIN_MS = 2000; // a tile that did not come
const AT_A_TIME = 4;
const KEPT = 160; // tiles, beyond those that are seen
const TURNED = 1.1; // pixels of a cell from which on it has edges
const UNKNOWN = 255;

const palettes = new Map();

function hex(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
}

const theme = () => document.documentElement.dataset.theme;

/** Colours of a kind of grid in this theme, RGBA as in an ImageData, by the byte of a cell. */
function paletteOf(kind) {
  const key = `${kind} ${theme()}`;
  if (palettes.has(key)) return palettes.get(key);
  const [unknown, free, wall, lethal, cost, zone] = ["map-unknown", "map-free", "map-wall", "cost-lethal", "cost", "zone"].map((name) => hex(`--${name}`));
  const colour = (value) => {
    if (kind === "map") return value === UNKNOWN ? [...unknown, 255] : value > 50 ? [...wall, 255] : [...free, 255];
    if (value === UNKNOWN || value === 0) return [0, 0, 0, 0];
    if (kind === "zones") return [...zone, 90];
    return value >= 99 ? [...lethal, 90] : [...cost, 10 + 0.7 * value];
  };
  const palette = new Uint32Array(new Uint8ClampedArray(Array.from({ length: 256 }, (_, value) => colour(value)).flat()).buffer);
  palettes.set(key, palette);
  return palette;
}

/** A grid as one message, and what updates it. */
export class WholeGrid {
  constructor(kind) {
    this.kind = kind;
    this.version = 0;
  }

  get info() {
    return this.message.info;
  }

  get frame() {
    return this.message.header.frame_id;
  }

  take(message) {
    this.message = message;
    this.version += 1;
    this._canvas = null;
  }

  /** Lay an OccupancyGridUpdate over it; only its cells are painted again. */
  patch({ x, y, width, height, data }) {
    if (!this.message || x + width > this.info.width || y + height > this.info.height) return;
    for (let row = 0; row < height; row++)
      for (let column = 0; column < width; column++) this.message.data[(y + row) * this.info.width + x + column] = data[row * width + column];
    this.version += 1;
    if (this._canvas && width && height) this._fill(x, y, width, height);
  }

  cells() {
    return Promise.resolve(this.message);
  }

  paint(c, cell) {
    const { width, height } = this.info;
    if (!this._canvas || this._theme !== theme()) {
      this._canvas = Object.assign(document.createElement("canvas"), { width, height });
      this._theme = theme();
      this._fill(0, 0, width, height);
    }
    c.imageSmoothingEnabled = cell < TURNED;
    c.drawImage(this._canvas, 0, -height * cell, width * cell, height * cell);
  }

  _fill(x, y, width, height) {
    const image = new ImageData(width, height), pixels = new Uint32Array(image.data.buffer), palette = paletteOf(this.kind);
    for (let row = 0; row < height; row++) {
      const from = (y + row) * this.info.width + x, to = (height - 1 - row) * width;
      for (let column = 0; column < width; column++) pixels[to + column] = palette[this.message.data[from + column] & 255];
    }
    this._canvas.getContext("2d").putImageData(image, x, this.info.height - y - height);
  }
}

/** A grid of which what is seen is asked for, as finely as it is seen. */
export class TiledGrid {
  /** Return the grid of a topic, null if this server has no tiles; throws if it has, but not now. */
  static async open(station, topic, kind) {
    const answer = await fetch(station.address("tiles.json", { topic }));
    if ([401, 403, 429, 503, 504].includes(answer.status)) throw new Error(await answer.text());
    if (!answer.ok || !answer.headers.get("Content-Type")?.startsWith("application/json")) return null;
    return new TiledGrid(station, topic, kind, await answer.json());
  }

  constructor(station, topic, kind, told) {
    Object.assign(this, { station, topic, kind });
    this._tiles = new Map(); // "z/x/y" -> {picture, stale, used}
    this._coming = new Set();
    this._failed = new Map(); // "z/x/y" -> when
    this._looked = performance.now();
    this._take(told);
  }

  _take({ changed, version, frame_id, ...info }) {
    this.info = info;
    this.frame = frame_id;
    this.version = version;
    const places = changed ?? [];
    if (changed === null) this._tiles.clear();
    for (const [key, tile] of this._tiles) {
      const [z, x, y] = key.split("/").map(Number), times = 2 ** (info.levels - 1 - z);
      tile.stale ||= places.some(([a, b]) => Math.floor(a / times) === x && Math.floor(b / times) === y);
    }
  }

  async _look() {
    if (this._looking || performance.now() - this._looked < LOOK_MS) return;
    this._looking = true;
    try {
      const answer = await fetch(this.station.address("tiles.json", { topic: this.topic, since: this.version }));
      if (answer.ok) this._take(await answer.json());
    } catch { /* no connection: it is looked again */ }
    this._looked = performance.now();
    this._looking = false;
  }

  /** Draw what is seen on a context whose origin is the grid's, with cells of so many pixels. */
  paint(c, cell) {
    this._look();
    if (this._theme !== theme()) this._tiles.clear(); // their colours are others; the browser still has their files
    this._theme = theme();
    const { width, height, levels, tile } = this.info, matrix = c.getTransform(), back = matrix.inverse();
    const ratio = Math.hypot(matrix.a, matrix.b), finest = levels - 1;
    const z = Math.max(0, finest - Math.max(0, Math.round(Math.log2(1 / (cell * ratio))))), times = 2 ** (finest - z), side = tile * times;
    const corners = [[0, 0], [c.canvas.width, 0], [0, c.canvas.height], [c.canvas.width, c.canvas.height]].map(([x, y]) => back.transformPoint({ x, y }));
    const range = (values, count) => [Math.max(0, Math.floor(Math.min(...values) / side)), Math.min(Math.ceil(count / side), Math.ceil(Math.max(...values) / side))];
    const [left, right] = range(corners.map(({ x }) => x / cell), width), [low, high] = range(corners.map(({ y }) => -y / cell), height);
    // Edges on whole pixels: neighbours neither gape nor overlap.
    const snap = Math.abs(matrix.b) < 1e-9;
    const across = (cells) => (snap ? (Math.round(matrix.e + cells * cell * ratio) - matrix.e) / ratio : cells * cell);
    const down = (cells) => (snap ? (Math.round(matrix.f - cells * cell * ratio) - matrix.f) / ratio : -cells * cell);
    const wanted = this._tiles.has("0/0/0") ? [] : ["0/0/0"]; // soon there is something
    c.imageSmoothingEnabled = cell * times < TURNED;
    for (let y = low; y < high; y++)
      for (let x = left; x < right; x++) {
        const key = `${z}/${x}/${y}`, own = this._tiles.get(key);
        if ((!own || own.stale) && key !== wanted[0]) wanted.push(key);
        const x0 = x * side, y0 = y * side, x1 = Math.min(x0 + side, width), y1 = Math.min(y0 + side, height);
        const found = this._best(z, x, y);
        if (!found) continue;
        // The part of the picture, its own or a coarser one's, that lies here: rows count from the north.
        const { picture, scale, fromX, fromY } = found, w = (x1 - x0) / scale, h = (y1 - y0) / scale;
        const sx = (x0 - fromX) / scale, sy = picture.height - (y1 - fromY) / scale;
        c.drawImage(picture, sx, Math.max(0, sy), w, h, across(x0), down(y1), across(x1) - across(x0), down(y0) - down(y1));
      }
    this._wanted = wanted;
    this._pump();
    this._forget((right - left) * (high - low) + KEPT);
  }

  /** The finest picture that there is of a place. */
  _best(z, x, y) {
    for (let up = 0; up <= z; up++) {
      const at = [z - up, x >> up, y >> up], found = this._tiles.get(at.join("/"));
      if (!found) continue;
      found.used = performance.now();
      const scale = 2 ** (this.info.levels - 1 - at[0]);
      return { picture: found.picture, scale, fromX: at[1] * scale * this.info.tile, fromY: at[2] * scale * this.info.tile };
    }
    return null;
  }

  _forget(most) {
    if (this._tiles.size <= most) return;
    const old = [...this._tiles].filter(([key]) => key !== "0/0/0").sort((a, b) => a[1].used - b[1].used);
    old.slice(0, this._tiles.size - most).forEach(([key]) => this._tiles.delete(key));
  }

  _pump() {
    for (const key of this._wanted) {
      if (this._coming.size >= AT_A_TIME) return;
      if (!this._coming.has(key) && performance.now() - (this._failed.get(key) ?? -AGAIN_MS) >= AGAIN_MS) this._fetch(key);
    }
  }

  async _fetch(key) {
    const { info, _theme: colours } = this;
    this._coming.add(key);
    this._failed.delete(key);
    const before = this._tiles.get(key);
    if (before) before.stale = false; // what changes from now on makes it stale again
    try {
      const image = await this._image(key), pixels = new Uint32Array(image.data.buffer), palette = paletteOf(this.kind);
      for (let i = 0; i < pixels.length; i++) pixels[i] = palette[pixels[i] & 255];
      const picture = await createImageBitmap(image);
      const isOld = info.width !== this.info.width || info.height !== this.info.height || colours !== this._theme;
      if (!isOld) this._tiles.set(key, { picture, stale: this._tiles.get(key)?.stale ?? false, used: performance.now() });
    } catch {
      this._failed.set(key, performance.now());
      if (before) before.stale = true;
    }
    this._coming.delete(key);
    this._pump();
  }

  /** A tile as an ImageData whose bytes are the cells. */
  async _image(key) {
    const answer = await fetch(this.station.address(`tiles/${key}.png`, { topic: this.topic }));
    if (!answer.ok) throw new Error(await answer.text());
    const bitmap = await createImageBitmap(await answer.blob(), { colorSpaceConversion: "none" });
    const c = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", { willReadFrequently: true });
    c.drawImage(bitmap, 0, 0);
    return c.getImageData(0, 0, bitmap.width, bitmap.height);
  }

  /** The grid as a message of at most so many cells on a side, coarser if it is larger. */
  async cells(most) {
    const { info } = this, times = 2 ** Math.min(info.levels - 1, Math.max(0, Math.ceil(Math.log2(Math.max(info.width, info.height) / most))));
    const z = info.levels - 1 - Math.log2(times), width = Math.ceil(info.width / times), height = Math.ceil(info.height / times);
    const data = new Array(width * height).fill(-1);
    for (let y = 0; y * info.tile < height; y++)
      for (let x = 0; x * info.tile < width; x++) {
        const image = await this._image(`${z}/${x}/${y}`);
        for (let row = 0; row < image.height; row++)
          for (let column = 0; column < image.width; column++) {
            const value = image.data[4 * ((image.height - 1 - row) * image.width + column)];
            data[(y * info.tile + row) * width + x * info.tile + column] = value === UNKNOWN ? -1 : value;
          }
      }
    return { info: { ...info, width, height, resolution: info.resolution * times }, data };
  }
}
