// Drawing by WebGPU, from the shaders as they are.
//
// With `reads`, pictures are read back and put on a plain canvas, for browsers whose WebGPU has no canvas
// (Chromium without a display and a GPU, as tests use it).
"use strict";

const COPY_WGSL = `
@group(0) @binding(0) var picture: texture_2d<f32>;
@vertex fn vs(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
@fragment fn fs(@builtin(position) at: vec4f) -> @location(0) vec4f {
  let c = textureLoad(picture, vec2i(at.xy), 0).rgb;
  return vec4f(select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308)), 1.0);
}`;

async function makeWebgpu(canvas, adapter, reads) {
  const device = await adapter.requestDevice();
  const context = canvas.getContext(reads ? "2d" : "webgpu");
  const format = navigator.gpu.getPreferredCanvasFormat();
  if (!reads) context.configure({ device, format, alphaMode: "opaque" });
  device.addEventListener("uncapturederror", (event) => fail(event.error));
  device.lost.then(lost);
  const programs = new Map(), meshes = new Map(), textures = new Map(), arrays = new Map(), tables = new Map();
  let targets = null, shaders = null, placing = null;

  const both = GPUShaderStage.VERTEX | GPUShaderStage.FRAGMENT;
  const layout = (...entries) => device.createBindGroupLayout({ entries: entries.map((entry, binding) => ({ binding, visibility: both, ...entry })) });
  const uniform = { buffer: {} };
  const numbers = (viewDimension) => ({ texture: { sampleType: "unfilterable-float", viewDimension } });
  const words = { texture: { sampleType: "uint" } };
  const viewLayout = layout(uniform);
  const sceneLayout = layout(uniform, { texture: { sampleType: "depth", viewDimension: "2d-array" } }, { sampler: { type: "comparison" } }, numbers("2d"), numbers("2d-array"), words, words);
  const textureLayout = layout({ texture: {} }, { sampler: {} });
  const depthOnly = device.createPipelineLayout({ bindGroupLayouts: [viewLayout] });
  const whole = device.createPipelineLayout({ bindGroupLayouts: [viewLayout, sceneLayout, textureLayout] });
  const placeLayout = layout(uniform, ...Array(4).fill(numbers("2d")));
  const bind = (groupLayout, ...resources) => device.createBindGroup({ layout: groupLayout, entries: resources.map((resource, binding) => ({ binding, resource })) });

  const compares = device.createSampler({ magFilter: "linear", minFilter: "linear", compare: "greater-equal" });
  const repeats = device.createSampler({ addressModeU: "repeat", addressModeV: "repeat", magFilter: "linear", minFilter: "linear", mipmapFilter: "linear" });
  const blank = (imageFormat) => device.createTexture({ size: [1, 1], format: imageFormat, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST });
  const [one, none, every] = [blank("r8unorm"), blank("r32uint"), blank("rgba8unorm")];
  device.queue.writeTexture({ texture: every }, new Uint8Array(4).fill(255), {}, [1, 1]);
  device.queue.writeTexture({ texture: one }, new Uint8Array([255]), {}, [1, 1]);
  const white = image(1, 1, new Uint8Array(4).fill(255));

  const copyModule = device.createShaderModule({ code: COPY_WGSL });
  const copy = await device.createRenderPipelineAsync({ layout: "auto", vertex: { module: copyModule }, fragment: { module: copyModule, targets: [{ format }] } });

  // A texture with mipmaps, each averaged from the one before, about in linear light.
  function image(width, height, rgba) {
    const mipLevelCount = 1 + Math.floor(Math.log2(Math.max(width, height)));
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
    const texture = device.createTexture({ size: [width, height], format: "rgba8unorm-srgb", mipLevelCount, usage });
    for (let level = 0, pixels = rgba, [w, h] = [width, height]; level < mipLevelCount; level++) {
      device.queue.writeTexture({ texture, mipLevel: level }, pixels, { bytesPerRow: 4 * w }, [w, h]);
      [pixels, w, h] = halved(pixels, w, h);
    }
    return bind(textureLayout, texture.createView(), repeats);
  }

  function halved(pixels, width, height) {
    const light = (x) => (x / 255) ** 2.2, byte = (x) => Math.round(255 * x ** (1 / 2.2));
    const [w, h] = [Math.max(width >> 1, 1), Math.max(height >> 1, 1)];
    const out = new Uint8Array(4 * w * h);
    for (let i = 0; i < out.length; i++) {
      const [x, y, k] = [(i >> 2) % w, Math.floor((i >> 2) / w), i & 3];
      const from = (dx, dy) => light(pixels[4 * (Math.min(2 * y + dy, height - 1) * width + Math.min(2 * x + dx, width - 1)) + k]);
      out[i] = byte((from(0, 0) + from(1, 0) + from(0, 1) + from(1, 1)) / 4);
    }
    return [out, w, h];
  }

  function buffer(usage, data) {
    const made = device.createBuffer({ size: Math.max(data.byteLength, 16), usage: usage | GPUBufferUsage.COPY_DST });
    device.queue.writeBuffer(made, 0, data);
    return made;
  }

  function attributes(recipe) {
    const vectors = (first, count) => Array.from({ length: count }, (_, k) => ({ shaderLocation: first + k, offset: 16 * k, format: "float32x4" }));
    const instances = (list) => ({ arrayStride: 4 * recipe.floats, stepMode: "instance", attributes: list });
    if (recipe.mesh) {
      const corner = [[0, 0], [1, 12], [8, 24]].map(([shaderLocation, offset]) => ({ shaderLocation, offset, format: "float32x3" }));
      return [{ arrayStride: 36, attributes: corner }, instances(vectors(2, recipe.floats / 4))];
    }
    if (recipe.bounds) return [instances([...vectors(0, 1), { shaderLocation: 1, offset: 16, format: "uint32" }])];
    return recipe.floats ? [instances(vectors(0, recipe.floats / 4))] : [];
  }

  function pipeline(recipe) {
    const over = { srcFactor: "one", dstFactor: "one-minus-src-alpha", operation: "add" };
    const target = { format: "rgba8unorm-srgb", ...(recipe.blend ? { blend: { color: over, alpha: over } } : {}) };
    return device.createRenderPipeline({
      layout: recipe.color ? whole : depthOnly,
      vertex: { module: shaders, entryPoint: recipe.vs, buffers: attributes(recipe) },
      fragment: recipe.fs ? { module: shaders, entryPoint: recipe.fs, constants: recipe.constants, targets: recipe.color ? [target] : [] } : undefined,
      primitive: { topology: recipe.strip ? "triangle-strip" : "triangle-list", cullMode: recipe.cull_front ? "front" : "none" },
      depthStencil: { format: "depth32float", depthWriteEnabled: recipe.write, depthCompare: recipe.compare, depthBias: recipe.bias[0], depthBiasSlopeScale: recipe.bias[1] },
      multisample: { count: recipe.color ? recipe.samples : 1 },
    });
  }

  // The pass that puts an eye's picture into the whole; programs are made for the channels that they write.
  function placePipeline(eye) {
    const key = eye.surface + " " + eye.channels;
    if (!placing.made.has(key)) {
      const writeMask = eye.channels.reduce((mask, on, k) => mask | (on ? 1 << k : 0), GPUColorWrite.ALPHA);
      placing.made.set(key, device.createRenderPipeline({
        layout: device.createPipelineLayout({ bindGroupLayouts: [placeLayout] }),
        vertex: { module: placing.module, entryPoint: "vs_place" },
        fragment: { module: placing.module, entryPoint: eye.surface ? "fs_surface" : "fs_place", targets: [{ format: "rgba8unorm-srgb", writeMask }] },
      }));
    }
    return placing.made.get(key);
  }

  function freeTargets() {
    if (targets) [targets.picture, targets.depth, targets.maps, targets.multiple, targets.finished, targets.source].forEach((t) => t && t.destroy());
    targets = null;
  }

  function drawItems(pass, list, color, of) {
    for (const { program, items, mesh, texture: picture, first, count } of list) {
      const { made, recipe } = programs.get(program);
      pass.setPipeline(made);
      if (color) pass.setBindGroup(2, textures.get(picture) ?? white);
      if (recipe.floats) pass.setVertexBuffer(recipe.mesh ? 1 : 0, arrays.get(inView(of, items)));
      if (recipe.mesh) {
        const { vertices, indices, count: corners } = meshes.get(mesh);
        pass.setVertexBuffer(0, vertices);
        pass.setIndexBuffer(indices, "uint32");
        pass.drawIndexed(corners, count, 0, 0, first);
      } else {
        pass.draw(recipe.vertices, count, 0, first);
      }
    }
  }

  // Returns the picture in memory, drawn before. Rows in buffers have multiples of 256 bytes.
  async function readBack([width, height]) {
    const bytesPerRow = 256 * Math.ceil(width / 64);
    const into = device.createBuffer({ size: bytesPerRow * height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    const encoder = device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture: targets.finished ?? targets.picture }, { buffer: into, bytesPerRow }, [width, height]);
    device.queue.submit([encoder.finish()]);
    await into.mapAsync(GPUMapMode.READ);
    const [bytes, pixels] = [new Uint8Array(into.getMappedRange()), new ImageData(width, height)];
    for (let y = 0; y < height; y++) pixels.data.set(bytes.subarray(y * bytesPerRow, y * bytesPerRow + 4 * width), 4 * y * width);
    into.destroy();
    return pixels;
  }

  const cleared = (view) => ({ view, depthClearValue: 0, depthLoadOp: "clear", depthStoreOp: "store" });

  return {
    name: "webgpu",
    module(code) { shaders = device.createShaderModule({ code }); },
    resize({ width, height, samples, mapSize, layers, whole: whole_px, source: source_px }) {
      freeTargets();
      const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING;
      const read = GPUTextureUsage.COPY_SRC;
      const make = (imageFormat, sampleCount, size = [width, height], more = 0) => device.createTexture({ size, format: imageFormat, sampleCount, usage: usage | more });
      const side = layers ? mapSize : 1;
      targets = {
        picture: make("rgba8unorm-srgb", 1, [width, height], read),
        depth: make("depth32float", samples),
        multiple: samples > 1 ? make("rgba8unorm-srgb", samples) : null,
        maps: make("depth32float", 1, [side, side, Math.max(layers, 1)]),
        finished: source_px ? make("rgba8unorm-srgb", 1, whole_px, read) : null,
        source: source_px ? make("rgba8unorm-srgb", 1, source_px, GPUTextureUsage.COPY_DST) : null,
        size: [width, height],
      };
      targets.all = targets.maps.createView({ dimension: "2d-array" });
      targets.copy = bind(copy.getBindGroupLayout(0), (targets.finished ?? targets.picture).createView());
    },
    passes({ wgsl }) { placing = { module: device.createShaderModule({ code: wgsl }), made: new Map() }; },
    numbers(id, numberFormat, width, height, data) {
      const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
      const texture = device.createTexture({ size: [width, height], format: numberFormat, usage });
      device.queue.writeTexture({ texture }, data, { bytesPerRow: data.byteLength / height }, [width, height]);
      tables.set(id, texture);
    },
    program(id, { recipe }) { programs.set(id, { made: pipeline(recipe), recipe }); },
    mesh(id, vertices, indices) {
      meshes.set(id, { vertices: buffer(GPUBufferUsage.VERTEX, vertices), indices: buffer(GPUBufferUsage.INDEX, indices), count: indices.length });
    },
    forgetMesh(id) {
      const mesh = meshes.get(id);
      [mesh.vertices, mesh.indices].forEach((b) => b.destroy());
      meshes.delete(id);
    },
    texture(id, width, height, rgba) { textures.set(id, image(width, height, rgba)); },
    forgetTexture(id) { textures.delete(id); },
    array(id, data) {
      const old = arrays.get(id);
      if (old && old.size === Math.max(data.byteLength, 16)) {
        device.queue.writeBuffer(old, 0, data);
      } else {
        if (old) old.destroy();
        arrays.set(id, buffer(GPUBufferUsage.VERTEX | GPUBufferUsage.UNIFORM, data));
      }
    },
    async draw({ size, eyes, casters, draws }) {
      const encoder = device.createCommandEncoder();
      const view = (id) => bind(viewLayout, { buffer: arrays.get(id) });
      for (let k = 0; k < size.layers; k++) {
        const layer = targets.maps.createView({ dimension: "2d", baseArrayLayer: k, arrayLayerCount: 1 });
        const pass = encoder.beginRenderPass({ colorAttachments: [], depthStencilAttachment: cleared(layer) });
        pass.setBindGroup(0, view(SHADOW_VIEW + k));
        drawItems(pass, casters, false, ONE_VIEW);
        pass.end();
      }
      const [picture, multiple] = [targets.picture.createView(), targets.multiple && targets.multiple.createView()];
      const color = { view: multiple ?? picture, resolveTarget: multiple ? picture : undefined, loadOp: "clear", storeOp: multiple ? "discard" : "store" };
      const scene = bind(sceneLayout, { buffer: arrays.get(SCENE) }, targets.all, compares, one.createView(), targets.all, none.createView(), none.createView());
      const drawView = (of) => {
        const pass = encoder.beginRenderPass({ colorAttachments: [color], depthStencilAttachment: cleared(targets.depth.createView()) });
        pass.setBindGroup(0, view(of.view));
        pass.setBindGroup(1, scene);
        drawItems(pass, draws, true, of);
        pass.end();
      };
      const drawEye = (eye, first) => {
        for (const of of eye.views) {
          drawView(of);
          encoder.copyTextureToTexture({ texture: targets.picture }, { texture: targets.source, origin: of.at }, targets.size);
        }
        const into = { view: targets.finished.createView(), loadOp: first ? "clear" : "load", clearValue: [0, 0, 0, 1], storeOp: "store" };
        const pass = encoder.beginRenderPass({ colorAttachments: [into] });
        const given = eye.numbers.map((id) => (id === null ? every : tables.get(id)).createView());
        pass.setPipeline(placePipeline(eye));
        pass.setBindGroup(0, bind(placeLayout, { buffer: arrays.get(eye.place) }, targets.source.createView(), ...given));
        pass.setScissorRect(...eye.at, ...eye.size);
        pass.draw(3);
        pass.end();
      };
      if (eyes) eyes.eyes.forEach((eye, k) => drawEye(eye, k === 0));
      else drawView(ONE_VIEW);
      device.queue.submit([encoder.finish()]);
      await device.queue.onSubmittedWorkDone();
      if (reads) targets.pixels = await readBack(eyes ? eyes.whole : [size.width, size.height]);
    },
    show() {
      if (reads) return context.putImageData(targets.pixels, 0, 0);
      const encoder = device.createCommandEncoder();
      const pass = encoder.beginRenderPass({ colorAttachments: [{ view: context.getCurrentTexture().createView(), loadOp: "clear", storeOp: "store" }] });
      pass.setPipeline(copy);
      pass.setBindGroup(0, targets.copy);
      pass.draw(3);
      pass.end();
      device.queue.submit([encoder.finish()]);
    },
    end() {
      freeTargets();
      [...meshes.keys()].forEach(this.forgetMesh);
      [arrays, tables].forEach((list) => list.forEach((items) => items.destroy()));
      placing = null;
      [textures, arrays, tables, programs].forEach((list) => list.clear());
    },
  };
}
