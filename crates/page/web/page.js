// The page around the module: opens scenes, steps them in real time, and shows the hash of the state.
//
// `#scene=NAME` in the link chooses a shipped scene; `#paused` does not step it; `#steps=N` steps N frames first.
"use strict";

const at = (id) => document.getElementById(id);
const TEXT = 0, GEOMETRY = 1, INSTANCES = 2, SURFACES = 3;
/** Longest simulated time that one picture may catch up with, s. */
const LATE = 0.1;

// State that tests and curious people read.
const state = { ready: false, error: "", scene: null, playing: false, pictures: 0 };
window.tumble = state;

let module = null, view = null, lag = 0, before = 0, opened = "falling";

function note(text) { at("note").textContent = text; }

function fail(text) {
  state.error = text;
  state.playing = false;
  at("play").textContent = "Play";
  note(text);
}

/** Message of an exception. */
function message(error) { return String(error && error.message || error); }

function bytes(kind) { return new Uint8Array(module.memory.buffer, module.buffer(kind), module.length(kind)); }
function numbers(kind) { return new Float32Array(module.memory.buffer, module.buffer(kind), module.length(kind) / 4); }
function text() { return new TextDecoder().decode(bytes(TEXT)); }

/** Opens a shipped scene by its name, or the text of a scene; returns whether it is one. After an error no scene is open. */
function open(source) {
  const given = new TextEncoder().encode(source), room = module.input(given.length);
  state.scene = null;
  if (!room) return fail("The file is larger than 16 MiB.");
  new Uint8Array(module.memory.buffer, room, given.length).set(given);
  if (!module.open(given.length)) return fail(text());
  opened = source;
  state.scene = JSON.parse(text());
  state.error = "";
  note("");
  lag = 0;
  view.load(state.scene, numbers(GEOMETRY));
  at("scene").value = state.scene.name;
  draw();
  return true;
}

/** Steps a number of frames; returns whether it went well. */
function step(frames) {
  if (module.step(frames)) return true;
  fail(text());
  return false;
}

/** Hash of the state, 64 hexadecimal digits. */
function hash() { return module.hash() ? text() : ""; }

function draw() {
  if (!state.scene || !module.picture()) return;
  view.draw(numbers(INSTANCES), numbers(SURFACES));
  at("time").textContent = `${module.time().toFixed(3)} s, frame ${module.frame()}`;
  at("hash").textContent = state.playing ? "" : "state " + hash().slice(0, 16);
  at("play").textContent = state.playing ? "Pause" : "Play";
  state.pictures += 1;
}

function tick(now) {
  requestAnimationFrame(tick);
  if (!state.scene) return;
  const passed = Math.min((now - before) / 1000, LATE);
  before = now;
  if (state.playing) {
    lag += passed;
    const frames = Math.floor(lag / state.scene.dt);
    lag -= frames * state.scene.dt;
    // a scene that is slower than real time is shown in slow motion
    const end = performance.now() + 1000 * LATE;
    for (let k = 0; k < frames && performance.now() < end; k++) if (!step(1)) break;
    draw();
  } else if (view.moved()) {
    draw();
  }
}

/** Shows what the link asks for. */
function follow() {
  const wanted = new URLSearchParams(location.hash.slice(1)), steps = Number(wanted.get("steps") ?? 0);
  if (!open(wanted.get("scene") ?? opened)) return;
  if (!(Number.isInteger(steps) && steps >= 0 && steps < 1e6)) return fail("`steps` in the link is no number of frames");
  if (steps && !step(steps)) return;
  state.playing = !wanted.has("paused");
  draw();
}

async function main() {
  const packed = Uint8Array.from(atob(at("module").textContent.trim()), (c) => c.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const { instance } = await WebAssembly.instantiate(await new Response(unpacked).arrayBuffer(), {});
  module = instance.exports;
  view = makeView(at("view"));
  module.scenes();
  at("scene").replaceChildren(...JSON.parse(text()).map((name) => new Option(name, name)));
  follow();
  Object.assign(state, { open, step, hash, draw, frame: () => module.frame(), ready: true });
  addEventListener("hashchange", follow);
  requestAnimationFrame(tick);
}

// errors after the start are shown too
addEventListener("error", (event) => fail(message(event.error || event.message)));
addEventListener("unhandledrejection", (event) => fail(message(event.reason)));

at("scene").onchange = () => open(at("scene").value);
at("play").onclick = () => { if (!state.scene) return; state.playing = !state.playing && !state.error; draw(); };
at("one").onclick = () => { if (!state.scene) return; state.playing = false; if (step(1)) draw(); };
at("again").onclick = () => open(opened);
at("file").onchange = async () => {
  const [file] = at("file").files;
  at("file").value = ""; // the same file can be opened again
  if (file) open(await file.text());
};
main().catch((error) => fail(message(error)));
