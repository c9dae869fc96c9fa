// A screen of a cave: receives pictures as numbers, draws each, and shows it when the cave says so.
//
// A binary message is a sequence of records: kind, length in words, words (little endian). A frame ends
// with its number and is drawn at once; `show` follows when all screens have drawn it.
"use strict";

const KIND = { SIZE: 1, MODULE: 2, PROGRAM: 3, MESH: 4, TEXTURE: 5, ARRAY: 6, DRAWS: 7, FORGET_MESH: 8, FORGET_TEXTURE: 9, FRAME: 10, SHOW: 11, PASSES: 12, NUMBERS: 13, EYES: 14 };
// numbers of the arrays: instances by kind, then the uniform blocks
const SHELLS = 5, SOFT = 7, VIEW = 8, SCENE = 9, SHADOW_VIEW = 10;
const at = (id) => document.getElementById(id);
const canvas = at("screen");
const note = (text) => { at("note").textContent = text; };

// State that tests and curious people read.
const state = { backend: "", drawn: -1, shown: -1, frames: 0, error: "" };
window.tumble = state;

// The picture as it was last received.
const picture = { size: null, eyes: null, arrays: new Map(), changed: new Set(), draws: [], casters: [] };
// The only view of a picture without eyes.
const ONE_VIEW = { view: VIEW, soft: SOFT, shells: SHELLS };
// The array of instances in a view: translucent ones have an order for each.
const inView = (view, items) => items === SOFT ? view.soft : items === SHELLS ? view.shells : items;

// Reads records; calls `take(kind, words)` for each.
function read(buffer, take) {
  const words = new Uint32Array(buffer);
  for (let i = 0; i + 2 <= words.length;) {
    const [kind, length] = [words[i], words[i + 1]];
    if (i + 2 + length > words.length) throw new Error("a message is cut off");
    take(kind, words.subarray(i + 2, i + 2 + length));
    i += 2 + length;
  }
}

// A text is its length in bytes and its bytes.
function text(words) {
  return new TextDecoder().decode(new Uint8Array(words.buffer, words.byteOffset + 4, words[0]));
}

// An array is its number, its length in vectors of four, a bit for each changed vector, and these.
function update(words) {
  const [id, count] = words;
  let array = picture.arrays.get(id);
  if (!array || array.length !== 4 * count) {
    const larger = new Uint32Array(4 * count);
    larger.set(array ? array.subarray(0, Math.min(array.length, larger.length)) : []);
    picture.arrays.set(id, array = larger);
  }
  let next = 2 + Math.ceil(count / 32);
  for (let i = 0; i < count; i++) {
    if (words[2 + (i >> 5)] >>> (i & 31) & 1) {
      array.set(words.subarray(next, next + 4), 4 * i);
      next += 4;
    }
  }
  picture.changed.add(id);
}

// Draws: program, array, mesh + 1, texture + 1, first and number of instances.
function draws(words) {
  const list = (from, count) => Array.from({ length: count }, (_, k) => {
    const [program, items, mesh, texture, first, number] = words.subarray(from + 6 * k, from + 6 * k + 6);
    return { program, items, mesh: mesh - 1, texture: texture - 1, first, count: number };
  });
  [picture.casters, picture.draws] = [list(1, words[0]), list(1 + 6 * words[0], (words.length - 1) / 6 - words[0])];
}

// Makes the targets for the picture: of a view, of the source of an eye's pass, and of the whole.
let size = "";
function resize(backend) {
  const { width, height } = picture.size;
  const [whole, source] = picture.eyes ? [picture.eyes.whole, picture.eyes.eyes[0].source] : [[width, height], null];
  const now = JSON.stringify([picture.size, whole, source]);
  if (now === size) return;
  size = now;
  [canvas.width, canvas.height] = whole;
  // interlaced eyes need the pixels of the display
  const exact = picture.eyes && picture.eyes.exact;
  [canvas.style.width, canvas.style.height] = exact ? whole.map((side) => side / devicePixelRatio + "px") : ["", ""];
  backend.resize({ ...picture.size, whole, source });
}

function take(backend, socket, kind, words) {
  switch (kind) {
    case KIND.SIZE: {
      const [width, height, samples, mapSize, layers] = words;
      picture.size = { width, height, samples, mapSize, layers };
      resize(backend);
      break;
    }
    case KIND.MODULE: backend.module(text(words)); break;
    case KIND.PROGRAM: backend.program(words[0], JSON.parse(text(words.subarray(1)))); break;
    case KIND.MESH: backend.mesh(words[0], words.subarray(2, 2 + words[1]), words.subarray(2 + words[1])); break;
    case KIND.TEXTURE: backend.texture(words[0], words[1], words[2], new Uint8Array(words.buffer, words.byteOffset + 12, 4 * words[1] * words[2])); break;
    case KIND.ARRAY: update(words); break;
    case KIND.DRAWS: draws(words); break;
    case KIND.PASSES: backend.passes(JSON.parse(text(words))); break;
    case KIND.NUMBERS: {
      const [id, format, width, height] = words;
      backend.numbers(id, ["rg32float", "rgba32float", "rgba16float"][format], width, height, words.subarray(4));
      break;
    }
    case KIND.EYES: {
      picture.eyes = JSON.parse(text(words));
      resize(backend);
      break;
    }
    case KIND.FORGET_MESH: backend.forgetMesh(words[0]); break;
    case KIND.FORGET_TEXTURE: backend.forgetTexture(words[0]); break;
    case KIND.FRAME: {
      const frame = words[0] + 2 ** 32 * words[1];
      for (const id of picture.changed) backend.array(id, picture.arrays.get(id));
      picture.changed.clear();
      backend.draw(picture).then(() => {
        state.drawn = frame;
        socket.send("drawn " + frame);
      }, fail);
      break;
    }
    case KIND.SHOW: {
      backend.show();
      state.shown = words[0] + 2 ** 32 * words[1];
      state.frames += 1;
      note("");
      socket.send("shown " + state.shown);
      break;
    }
    default: throw new Error("a message of another version");
  }
}

let current = null, backend = null;

function fail(error) {
  state.error = String(error && error.message || error);
  note("This browser cannot draw: " + state.error);
  if (current && current.readyState === WebSocket.OPEN) {
    current.send("failed " + state.error.slice(0, 120));
    current.close();
  }
}

// A device that is lost, as when a phone sleeps, comes back with the page.
function lost() {
  fail(new Error("the device was lost; the page is loaded again"));
  setTimeout(() => location.reload(), 5000);
}

async function open() {
  const wanted = new URLSearchParams(location.hash.slice(1)).get("draw");
  try {
    backend ??= await makeBackend(wanted);
  } catch (error) {
    fail(error);
    return;
  }
  state.backend = backend.name;
  const socket = current = new WebSocket(location.origin.replace(/^http/, "ws") + location.pathname + "socket");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { note("waiting for a frame…"); socket.send("hello " + backend.name); };
  socket.onmessage = (message) => {
    try {
      read(message.data, (kind, words) => take(backend, socket, kind, words));
    } catch (error) {
      fail(error);
    }
  };
  socket.onclose = () => {
    backend.end();
    if (state.error) return;
    note("The cave is not there; trying again…");
    picture.arrays.clear();
    [picture.eyes, size] = [null, ""];
    setTimeout(open, 2000);
  };
}

// `#draw=webgpu` in the link chooses WebGPU; `webgpu-read` puts its pictures on a plain canvas.
async function makeBackend(wanted) {
  if (!wanted || !wanted.startsWith("webgpu")) return makeWebgl(canvas);
  const adapter = navigator.gpu && await navigator.gpu.requestAdapter().catch(() => null);
  if (!adapter) throw new Error("there is no WebGPU");
  return makeWebgpu(canvas, adapter, wanted === "webgpu-read");
}

at("full").onclick = () => document.documentElement.requestFullscreen().catch(() => {});
let idle;
onpointermove = () => {
  document.body.classList.remove("idle");
  clearTimeout(idle);
  idle = setTimeout(() => document.body.classList.add("idle"), 3000);
};
onpointermove();
if (navigator.wakeLock) {
  const awake = () => document.visibilityState === "visible" && navigator.wakeLock.request("screen").catch(() => {});
  document.onvisibilitychange = awake;
  awake();
}
open();
