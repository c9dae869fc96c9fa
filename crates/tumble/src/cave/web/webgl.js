// Drawing by WebGL 2, from the shaders as GLSL ES 3.00.
//
// The picture is drawn into a texture with the first row at the top, as the shaders expect, and copied to
// the canvas when it is shown.
"use strict";

const COPY = [
  `#version 300 es
  void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`,
  `#version 300 es
  precision highp float;
  uniform highp sampler2D picture;
  out vec4 color;
  void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 c = texelFetch(picture, ivec2(at.x, textureSize(picture, 0).y - 1 - at.y), 0).rgb;
    color = vec4(mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308))), 1.0);
  }`,
];

function makeWebgl(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("there is no WebGL 2");
  canvas.addEventListener("webglcontextlost", lost);
  const unit = { shadow_maps: 0, shadow_depths: 1, occlusion: 2, albedo: 3, source: 4, warp: 5, shares: 6, table: 7 };
  const programs = new Map(), meshes = new Map(), textures = new Map(), arrays = new Map(), tables = new Map();
  let targets = null, copy = null, placing = null;

  function compile(vertex, fragment) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error("a shader: " + [gl.getProgramInfoLog(program), ...logs].join(" ").trim());
    }
    return program;
  }

  function buffer(target, words) {
    const made = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(target, made);
    gl.bufferData(target, words, gl.STATIC_DRAW);
    return made;
  }

  function texture(target, filter, repeat) {
    const made = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit.albedo);
    gl.bindTexture(target, made);
    gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter === gl.NEAREST ? gl.NEAREST : gl.LINEAR);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, axis, repeat ? gl.REPEAT : gl.CLAMP_TO_EDGE);
    return made;
  }

  function image(width, height, rgba) {
    const made = texture(gl.TEXTURE_2D, gl.LINEAR_MIPMAP_LINEAR, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    gl.generateMipmap(gl.TEXTURE_2D);
    return made;
  }

  // A layer of shadow maps compares; the same layer as numbers does not.
  function sampler(filter, compare) {
    const made = gl.createSampler();
    gl.samplerParameteri(made, gl.TEXTURE_MIN_FILTER, filter);
    gl.samplerParameteri(made, gl.TEXTURE_MAG_FILTER, filter);
    for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.samplerParameteri(made, axis, gl.CLAMP_TO_EDGE);
    if (compare) {
      gl.samplerParameteri(made, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
      gl.samplerParameteri(made, gl.TEXTURE_COMPARE_FUNC, gl.GEQUAL);
    }
    return made;
  }

  const white = image(1, 1, new Uint8Array(4).fill(255));
  const samplers = { shadow_maps: sampler(gl.LINEAR, true), shadow_depths: sampler(gl.NEAREST, false) };

  // A texture of numbers, which is read without a filter.
  function numbers(format, width, height, words) {
    const made = texture(gl.TEXTURE_2D, gl.NEAREST, false);
    const [internal, channels, type, array] = {
      rg32float: [gl.RG32F, gl.RG, gl.FLOAT, Float32Array],
      rgba32float: [gl.RGBA32F, gl.RGBA, gl.FLOAT, Float32Array],
      rgba16float: [gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT, Uint16Array],
    }[format];
    const values = new array(words.buffer, words.byteOffset, words.byteLength / array.BYTES_PER_ELEMENT);
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, channels, type, values);
    return made;
  }

  // A color target alone.
  function plainTarget([width, height]) {
    const made = { texture: texture(gl.TEXTURE_2D, gl.NEAREST, false), framebuffer: gl.createFramebuffer(), width, height };
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.SRGB8_ALPHA8, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, made.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made.texture, 0);
    return made;
  }

  function makeTargets({ width, height, samples, mapSize, layers, whole: whole_px, source: source_px }) {
    const [finished, source] = source_px ? [plainTarget(whole_px), plainTarget(source_px)] : [null, null];
    const picture = texture(gl.TEXTURE_2D, gl.NEAREST, false);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.SRGB8_ALPHA8, width, height);
    const framebuffer = (color, depth) => {
      const made = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, made);
      color();
      if (depth) gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
      const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
      if (status !== gl.FRAMEBUFFER_COMPLETE) throw new Error("no target of " + width + " x " + height + " pixels: " + status);
      return made;
    };
    const renderbuffer = (format) => {
      const made = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, made);
      if (samples > 1) gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      else gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      return made;
    };
    const toPicture = () => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, picture, 0);
    const buffers = [renderbuffer(gl.DEPTH_COMPONENT32F)];
    let whole, resolved = null;
    if (samples > 1) {
      buffers.push(renderbuffer(gl.SRGB8_ALPHA8));
      whole = framebuffer(() => gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffers[1]), buffers[0]);
      resolved = framebuffer(toPicture, null);
    } else {
      whole = framebuffer(toPicture, buffers[0]);
    }
    const side = layers ? mapSize : 1;
    const maps = texture(gl.TEXTURE_2D_ARRAY, gl.NEAREST, false);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.DEPTH_COMPONENT32F, side, side, Math.max(layers, 1));
    const layer = gl.createFramebuffer();
    return { picture, buffers, whole, resolved, maps, layer, width, height, side, layers, finished, source };
  }

  function freeTargets() {
    if (!targets) return;
    [targets.picture, targets.maps].forEach((t) => gl.deleteTexture(t));
    targets.buffers.forEach((b) => gl.deleteRenderbuffer(b));
    [targets.whole, targets.resolved, targets.layer].forEach((f) => f && gl.deleteFramebuffer(f));
    for (const plain of [targets.finished, targets.source]) {
      if (!plain) continue;
      gl.deleteTexture(plain.texture);
      gl.deleteFramebuffer(plain.framebuffer);
    }
    targets = null;
  }

  function bindTextures() {
    for (const name of ["shadow_maps", "shadow_depths"]) {
      gl.activeTexture(gl.TEXTURE0 + unit[name]);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, targets.maps);
      gl.bindSampler(unit[name], samplers[name]);
    }
    gl.activeTexture(gl.TEXTURE0 + unit.occlusion);
    gl.bindTexture(gl.TEXTURE_2D, white);
  }

  function setState({ compare, write, bias, blend, cull_front }) {
    gl.depthFunc(compare === "always" ? gl.ALWAYS : gl.GEQUAL);
    gl.depthMask(write);
    gl.polygonOffset(bias[1], bias[0]);
    for (const [on, what] of [[bias[0] !== 0, gl.POLYGON_OFFSET_FILL], [blend, gl.BLEND], [cull_front, gl.CULL_FACE]]) {
      if (on) gl.enable(what); else gl.disable(what);
    }
  }

  // Points the vertex stage at the instances from `first` on.
  function setInstances(recipe, items, first) {
    gl.bindBuffer(gl.ARRAY_BUFFER, items);
    const base = recipe.mesh ? 2 : 0, stride = 4 * recipe.floats;
    for (let k = 0; k < (recipe.bounds ? 2 : recipe.floats / 4); k++) {
      gl.enableVertexAttribArray(base + k);
      if (recipe.bounds && k === 1) gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_INT, stride, first * stride + 16);
      else gl.vertexAttribPointer(base + k, 4, gl.FLOAT, false, stride, first * stride + 16 * k);
      gl.vertexAttribDivisor(base + k, 1);
    }
  }

  function setMesh(mesh) {
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    [[0, 0], [1, 12], [8, 24]].forEach(([location, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 36, offset);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
  }

  // Draws one view into the picture.
  function drawView(view, draws) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, targets.whole);
    gl.viewport(0, 0, targets.width, targets.height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, arrays.get(view.view));
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 1, arrays.get(SCENE));
    drawItems(draws, view);
    if (targets.resolved) {
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, targets.resolved);
      const box = [0, 0, targets.width, targets.height];
      gl.blitFramebuffer(...box, ...box, gl.COLOR_BUFFER_BIT, gl.NEAREST);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, targets.resolved);
    }
  }

  // Draws the views of an eye into its source, and puts that into the whole.
  function drawEye(eye, draws, first) {
    for (const view of eye.views) {
      drawView(view, draws);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, targets.resolved ?? targets.whole);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, targets.source.framebuffer);
      const [x, y] = view.at;
      const into = [x, y, x + targets.width, y + targets.height];
      gl.blitFramebuffer(0, 0, targets.width, targets.height, ...into, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, targets.finished.framebuffer);
    gl.viewport(0, 0, targets.finished.width, targets.finished.height);
    [gl.DEPTH_TEST, gl.BLEND, gl.CULL_FACE, gl.POLYGON_OFFSET_FILL].forEach((what) => gl.disable(what));
    if (first) {
      gl.clearColor(0, 0, 0, 1);
      gl.clear(gl.COLOR_BUFFER_BIT);
      gl.clearColor(0, 0, 0, 0);
    }
    gl.useProgram(eye.surface ? placing.surface : placing.place);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, arrays.get(eye.place));
    const [warp, shares, table] = eye.numbers.map((id) => id === null ? white : tables.get(id));
    for (const [name, image] of Object.entries({ source: targets.source.texture, warp, shares, table })) {
      gl.activeTexture(gl.TEXTURE0 + unit[name]);
      gl.bindTexture(gl.TEXTURE_2D, image);
    }
    gl.colorMask(...eye.channels, true);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...eye.at, ...eye.size);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    gl.colorMask(true, true, true, true);
    // the source is drawn again for the next eye
    gl.activeTexture(gl.TEXTURE0 + unit.source);
    gl.bindTexture(gl.TEXTURE_2D, null);
  }

  function drawItems(list, view) {
    for (const { program, items, mesh, texture: image, first, count } of list) {
      const { made, recipe } = programs.get(program);
      gl.useProgram(made);
      setState(recipe);
      const vao = gl.createVertexArray();
      gl.bindVertexArray(vao);
      if (recipe.floats) setInstances(recipe, arrays.get(inView(view, items)), first);
      gl.activeTexture(gl.TEXTURE0 + unit.albedo);
      gl.bindTexture(gl.TEXTURE_2D, textures.get(image) ?? white);
      if (recipe.mesh) {
        setMesh(meshes.get(mesh));
        gl.drawElementsInstanced(gl.TRIANGLES, meshes.get(mesh).count, gl.UNSIGNED_INT, 0, count);
      } else {
        gl.drawArraysInstanced(recipe.strip ? gl.TRIANGLE_STRIP : gl.TRIANGLES, 0, recipe.vertices, count);
      }
      gl.deleteVertexArray(vao);
    }
  }

  return {
    name: "webgl2",
    module() {},
    resize(size) {
      freeTargets();
      targets = makeTargets(size);
    },
    passes(programs) {
      placing = {};
      for (const [name, { vertex, fragment, blocks, textures: names }] of Object.entries(programs)) {
        const made = placing[name] = compile(vertex, fragment);
        gl.useProgram(made);
        for (const block of Object.keys(blocks)) {
          const index = gl.getUniformBlockIndex(made, block);
          if (index !== gl.INVALID_INDEX) gl.uniformBlockBinding(made, index, 0);
        }
        for (const [sampler, variable] of Object.entries(names)) gl.uniform1i(gl.getUniformLocation(made, sampler), unit[variable]);
      }
    },
    numbers(id, ...data) { tables.set(id, numbers(...data)); },
    program(id, { recipe, vertex, fragment, blocks, textures: names }) {
      const made = compile(vertex, fragment);
      gl.useProgram(made);
      for (const [name, variable] of Object.entries(blocks)) {
        const index = gl.getUniformBlockIndex(made, name);
        if (index !== gl.INVALID_INDEX) gl.uniformBlockBinding(made, index, variable === "view" ? 0 : 1);
      }
      for (const [name, variable] of Object.entries(names)) gl.uniform1i(gl.getUniformLocation(made, name), unit[variable]);
      programs.set(id, { made, recipe });
    },
    mesh(id, vertices, indices) {
      meshes.set(id, { vertices: buffer(gl.ARRAY_BUFFER, vertices), indices: buffer(gl.ELEMENT_ARRAY_BUFFER, indices), count: indices.length });
    },
    forgetMesh(id) {
      const mesh = meshes.get(id);
      [mesh.vertices, mesh.indices].forEach((b) => gl.deleteBuffer(b));
      meshes.delete(id);
    },
    texture(id, width, height, rgba) { textures.set(id, image(width, height, rgba)); },
    forgetTexture(id) {
      gl.deleteTexture(textures.get(id));
      textures.delete(id);
    },
    array(id, words) {
      if (!arrays.has(id)) arrays.set(id, gl.createBuffer());
      gl.bindVertexArray(null);
      gl.bindBuffer(gl.ARRAY_BUFFER, arrays.get(id));
      gl.bufferData(gl.ARRAY_BUFFER, words, gl.DYNAMIC_DRAW);
    },
    async draw({ size, eyes, casters, draws }) {
      gl.enable(gl.DEPTH_TEST);
      gl.cullFace(gl.FRONT);
      gl.frontFace(gl.CW); // the picture is upside down for WebGL
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.clearColor(0, 0, 0, 0);
      gl.clearDepth(0);
      gl.depthMask(true);
      // no map is read while it is drawn
      for (const name of ["shadow_maps", "shadow_depths"]) {
        gl.activeTexture(gl.TEXTURE0 + unit[name]);
        gl.bindTexture(gl.TEXTURE_2D_ARRAY, null);
      }
      gl.bindFramebuffer(gl.FRAMEBUFFER, targets.layer);
      gl.viewport(0, 0, targets.side, targets.side);
      for (let k = 0; k < size.layers; k++) {
        gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, targets.maps, 0, k);
        gl.depthMask(true);
        gl.clear(gl.DEPTH_BUFFER_BIT);
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, arrays.get(SHADOW_VIEW + k));
        drawItems(casters, ONE_VIEW);
      }
      bindTextures();
      if (eyes) eyes.eyes.forEach((eye, k) => drawEye(eye, draws, k === 0));
      else drawView(ONE_VIEW, draws);
      // waits until the picture is drawn
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      const error = gl.getError();
      if (error !== gl.NO_ERROR) throw new Error("WebGL " + error.toString(16));
    },
    show() {
      copy ??= compile(...COPY);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.disable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      gl.disable(gl.CULL_FACE);
      gl.useProgram(copy);
      gl.bindVertexArray(null);
      gl.activeTexture(gl.TEXTURE0 + unit.albedo);
      gl.bindTexture(gl.TEXTURE_2D, targets.finished ? targets.finished.texture : targets.picture);
      gl.uniform1i(gl.getUniformLocation(copy, "picture"), unit.albedo);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    },
    end() {
      freeTargets();
      [...meshes.keys()].forEach(this.forgetMesh);
      [...textures.keys()].forEach(this.forgetTexture);
      arrays.forEach((items) => gl.deleteBuffer(items));
      programs.forEach(({ made }) => gl.deleteProgram(made));
      Object.values(placing ?? {}).forEach((made) => gl.deleteProgram(made));
      tables.forEach((table) => gl.deleteTexture(table));
      placing = null;
      [arrays, programs, tables].forEach((list) => list.clear());
    },
  };
}
