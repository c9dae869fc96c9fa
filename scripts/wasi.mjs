// Runs a program for wasm32-wasip1 in Node: node scripts/wasi.mjs PROGRAM.wasm [words]
// The program gets its words, and writes to stdout and stderr. It has no files, no environment and no random numbers, and its clock stands
// still. (Node's own module `node:wasi` ends with a segmentation fault in version 20 after a long run.)
import { readFileSync, writeSync } from "node:fs";

const [program, ...words] = process.argv.slice(2);
const BAD_DESCRIPTOR = 8, NOT_THERE = 52;
const texts = [program, ...words].map((word) => new TextEncoder().encode(word + "\0"));
let memory;
const view = () => new DataView(memory.buffer);

class Exit extends Error {
  constructor(code) { super("exit"); this.code = code; }
}

const calls = {
  args_sizes_get(count, size) {
    view().setUint32(count, texts.length, true);
    view().setUint32(size, texts.reduce((sum, text) => sum + text.length, 0), true);
    return 0;
  },
  args_get(places, bytes) {
    for (const text of texts) {
      view().setUint32(places, bytes, true);
      new Uint8Array(memory.buffer).set(text, bytes);
      [places, bytes] = [places + 4, bytes + text.length];
    }
    return 0;
  },
  environ_sizes_get(count, size) {
    view().setUint32(count, 0, true);
    view().setUint32(size, 0, true);
    return 0;
  },
  environ_get: () => 0,
  clock_time_get(_clock, _precision, time) { view().setBigUint64(time, 0n, true); return 0; },
  random_get(bytes, length) { new Uint8Array(memory.buffer, bytes, length).fill(0); return 0; },
  sched_yield: () => 0,
  fd_prestat_get: () => BAD_DESCRIPTOR,
  fd_write(file, pieces, count, written) {
    if (file !== 1 && file !== 2) return BAD_DESCRIPTOR;
    let sum = 0;
    for (let k = 0; k < count; k++) {
      const [start, length] = [view().getUint32(pieces + 8 * k, true), view().getUint32(pieces + 8 * k + 4, true)];
      const bytes = new Uint8Array(memory.buffer, start, length).slice();
      for (let at = 0; at < length;) at += writeSync(file, bytes, at);
      sum += length;
    }
    view().setUint32(written, sum, true);
    return 0;
  },
  proc_exit(code) { throw new Exit(code); },
};
const imports = new Proxy(calls, { get: (known, name) => known[name] ?? (() => NOT_THERE) });

const { instance } = await WebAssembly.instantiate(readFileSync(program), { wasi_snapshot_preview1: imports });
memory = instance.exports.memory;
try {
  instance.exports._start();
} catch (error) {
  if (!(error instanceof Exit)) throw error;
  process.exitCode = error.code;
}
