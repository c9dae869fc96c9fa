// Draws instances of meshes, and surfaces that deform, by WebGL 2: lights with one shadow map, a floor, a sky.
"use strict";

const COMMON = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
`;
const VERTEX = COMMON + `
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 color;
layout(location = 3) in mat4 model;
uniform mat4 view, light;
out vec3 place, up, tint;
out vec4 in_light;
flat out float opacity;
void main() {
  vec4 world = model * vec4(position, 1.0);
  place = world.xyz;
  up = mat3(model) * normal;
  tint = color.rgb;
  opacity = color.a;
  in_light = light * world;
  gl_Position = view * world;
}`;
const FRAGMENT = COMMON + `
in vec3 place, up, tint;
in vec4 in_light;
flat in float opacity;
uniform vec3 eye, zenith, floor_color, second;
uniform vec4 lights[8];   // direction to a distant light and 0, or place and 1
uniform vec3 powers[8];
uniform int count;
uniform float ambient, scale;
uniform sampler2DShadow shadow;
out vec4 shown;
vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
// Soft spheres are drawn as a share of their pixels, by an ordered pattern of 4 x 4: their order does not matter.
bool left_out(float cosine) {
  if (opacity >= 1.0) return false;
  ivec2 p = ivec2(gl_FragCoord.xy) & 3, q = p >> 1;
  int a = ((p.x ^ p.y) & 1) * 8 + (p.y & 1) * 4 + ((q.x ^ q.y) & 1) * 2 + (q.y & 1);
  return 1.0 - pow(1.0 - opacity, cosine * cosine * cosine) < (float(a) + 0.5) / 16.0;
}
void main() {
  if (left_out(abs(dot(normalize(eye - place), normalize(up))))) discard;
  vec3 albedo = linear(tint);
  if (scale > 0.0) {
    vec2 cell = floor(place.xy / scale);
    vec2 width = fwidth(place.xy / scale);
    float fine = clamp(2.0 * max(width.x, width.y), 0.0, 1.0);
    float odd = mod(cell.x + cell.y, 2.0);
    albedo = mix(albedo, linear(second), mix(odd, 0.5, fine));
  }
  vec3 to_eye = normalize(eye - place), n = normalize(up);
  if (dot(n, to_eye) < 0.0) n = -n;
  vec3 sum = ambient * mix(linear(floor_color), linear(zenith), 0.5 + 0.5 * n.z) * albedo;
  for (int k = 0; k < count; k++) {
    vec3 way = lights[k].xyz - lights[k].w * place;
    float fall = lights[k].w > 0.0 ? 1.0 / max(dot(way, way), 1e-4) : 1.0;
    vec3 to_light = normalize(way);
    float lit = max(dot(n, to_light), 0.0) * fall;
    if (k == 0 && lit > 0.0) {
      vec3 at = in_light.xyz / in_light.w * 0.5 + 0.5;
      bool inside = all(greaterThan(at, vec3(0.0))) && all(lessThan(at, vec3(1.0)));
      at.z -= 0.0015 + 0.003 * (1.0 - dot(n, to_light));
      if (inside) {
        float open = 0.0;
        for (int i = -1; i <= 1; i++) for (int j = -1; j <= 1; j++) open += texture(shadow, at + vec3(float(i), float(j), 0.0) / 2048.0);
        lit *= open / 9.0;
      }
    }
    float gloss = 0.15 * pow(max(dot(n, normalize(to_light + to_eye)), 0.0), 40.0);
    sum += powers[k] * lit * (albedo + gloss);
  }
  shown = vec4(pow(sum / (1.0 + 0.25 * sum), vec3(1.0 / 2.2)), 1.0);
}`;
const DEPTH = COMMON + "flat in float opacity; void main() { if (opacity < 1.0) discard; }";
const SKY = [COMMON + `
out vec2 at;
void main() { at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0); gl_Position = vec4(at, 1.0, 1.0); }`,
COMMON + `
in vec2 at;
uniform mat4 back;
uniform vec3 zenith, horizon, nadir;
out vec4 shown;
void main() {
  vec4 near = back * vec4(at, -1.0, 1.0), far = back * vec4(at, 1.0, 1.0);
  float z = normalize(far.xyz / far.w - near.xyz / near.w).z;
  shown = vec4(z > 0.0 ? mix(horizon, zenith, sqrt(z)) : mix(horizon, nadir, min(-4.0 * z, 1.0)), 1.0);
}`];

const MAP = 2048, INSTANCE = 20, SURFACE = 9;
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const minus = (a, b) => a.map((x, k) => x - b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a); return n > 0 ? a.map((x) => x / n) : [0, 0, 1]; };

// Matrices are columns, as in WebGL.
function times(a, b) {
  return Array.from({ length: 16 }, (_, k) => [0, 1, 2, 3].reduce((sum, j) => sum + a[4 * j + k % 4] * b[4 * (k >> 2) + j], 0));
}
function lookAt(eye, target, up) {
  const back = unit(minus(eye, target)), side = unit(cross(up, back)), top = cross(back, side);
  return [side[0], top[0], back[0], 0, side[1], top[1], back[1], 0, side[2], top[2], back[2], 0, -dot(side, eye), -dot(top, eye), -dot(back, eye), 1];
}
function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(0.5 * fov * Math.PI / 180);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
}
function parallel(half, near, far) {
  return [1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, 2 / (near - far), 0, 0, 0, (far + near) / (near - far), 1];
}
function inverse(m) {
  // Gauss–Jordan elimination with row exchanges
  const rows = [0, 1, 2, 3].map((i) => [0, 1, 2, 3].map((j) => m[4 * j + i]).concat([0, 1, 2, 3].map((j) => Number(i === j))));
  for (let c = 0; c < 4; c++) {
    const pivot = [c, c + 1, c + 2, c + 3].filter((r) => r < 4).reduce((a, b) => Math.abs(rows[b][c]) > Math.abs(rows[a][c]) ? b : a);
    [rows[c], rows[pivot]] = [rows[pivot], rows[c]];
    rows[c] = rows[c].map((x) => x / rows[c][c]);
    for (let r = 0; r < 4; r++) if (r !== c) rows[r] = rows[r].map((x, k) => x - rows[r][c] * rows[c][k]);
  }
  return Array.from({ length: 16 }, (_, k) => rows[k % 4][4 + (k >> 2)]);
}

function makeView(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) throw new Error("This browser has no WebGL 2.");
  canvas.addEventListener("webglcontextlost", () => location.reload());

  function compile(vertex, fragment) {
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error("a shader: " + gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("a shader: " + gl.getProgramInfoLog(program));
    const places = new Map();
    return { program, at: (name) => { if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name)); return places.get(name); } };
  }

  const lit = compile(VERTEX, FRAGMENT), depth = compile(VERTEX, DEPTH), sky = compile(...SKY);
  const map = gl.createTexture(), target = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, map);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, MAP, MAP);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, map, 0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  const [geometry, instances, surfaces, floor] = [1, 2, 3, 4].map(() => gl.createBuffer());
  let scene = null, eye = [4, -6, 3], aim = [0, 0, 0], moved = false, size = "";

  function vertices(buffer, stride, colors) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    for (const [place, offset] of colors ? [[0, 0], [1, 12], [2, 24]] : [[0, 0], [1, 12]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 4 * stride, offset);
      gl.vertexAttribDivisor(place, 0);
    }
  }
  function placedBy(buffer, first) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    [[3, 0], [4, 16], [5, 32], [6, 48], [2, 64]].forEach(([place, offset]) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 4, gl.FLOAT, false, 4 * INSTANCE, 4 * INSTANCE * first + offset);
      gl.vertexAttribDivisor(place, 1);
    });
  }
  function atOrigin() {
    for (let column = 0; column < 4; column++) {
      gl.disableVertexAttribArray(3 + column);
      gl.vertexAttrib4fv(3 + column, IDENTITY.slice(4 * column, 4 * column + 4));
    }
  }

  function drawAll(clouds, corners) {
    vertices(geometry, 6, false);
    for (const [mesh, first, count] of [...scene.draws, [0, scene.placed, clouds]]) {
      if (!count || !scene.meshes[mesh][1]) continue;
      placedBy(instances, first);
      gl.drawArraysInstanced(gl.TRIANGLES, ...scene.meshes[mesh], count);
    }
    if (corners) {
      atOrigin();
      vertices(surfaces, SURFACE, true);
      gl.drawArrays(gl.TRIANGLES, 0, corners);
    }
  }

  function lamps() {
    const found = scene.lights.slice(0, 8).map((l) => ({
      way: l.direction ? [...unit(l.direction.map((x) => -x)), 0] : [...l.position, 1],
      power: l.color.map((c) => Math.pow(c, 2.2) * l.intensity),
    }));
    found.sort((a, b) => a.way[3] - b.way[3]); // a distant light first: it casts the shadows
    return found.length ? found : [{ way: [...unit([0.4, -0.5, 0.8]), 0], power: [2, 2, 2] }];
  }

  function resize() {
    const ratio = Math.min(devicePixelRatio, 2), [w, h] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (size === w + "x" + h) return;
    size = w + "x" + h;
    [canvas.width, canvas.height] = [w, h];
  }

  canvas.onpointermove = (event) => {
    if (!event.buttons || !scene) return;
    const arm = minus(eye, aim), r = Math.hypot(...arm);
    if (event.buttons & 1) {
      const turn = Math.atan2(arm[1], arm[0]) - 0.008 * event.movementX;
      const tilt = Math.min(1.5, Math.max(-1.5, Math.asin(arm[2] / r) + 0.008 * event.movementY));
      eye = [aim[0] + r * Math.cos(tilt) * Math.cos(turn), aim[1] + r * Math.cos(tilt) * Math.sin(turn), aim[2] + r * Math.sin(tilt)];
    } else {
      const side = unit(cross([0, 0, 1], arm)), top = unit(cross(arm, side)), k = 0.0015 * r;
      const move = side.map((x, i) => -k * event.movementX * x + k * event.movementY * top[i]);
      [eye, aim] = [eye, aim].map((p) => p.map((x, i) => x + move[i]));
    }
    moved = true;
  };
  canvas.oncontextmenu = () => false;
  canvas.onwheel = (event) => {
    event.preventDefault();
    const factor = Math.exp(0.001 * event.deltaY);
    eye = aim.map((a, k) => a + factor * (eye[k] - a));
    moved = true;
  };
  addEventListener("resize", () => { moved = true; });

  return {
    moved: () => { const was = moved; moved = false; return was; },
    load(description, corners) {
      scene = description;
      const camera = scene.camera ?? { eye: [4, -6, 3], target: [0, 0, 0.5], fov: 45, near: 0.05, far: 500 };
      [eye, aim] = [camera.eye, camera.target];
      scene.camera = camera;
      gl.bindBuffer(gl.ARRAY_BUFFER, geometry);
      gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
      if (scene.ground) {
        const { height, color } = scene.ground;
        const corner = (x, y) => [60 * x, 60 * y, height, 0, 0, 1, ...color];
        const quad = [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) => corner(x, y));
        gl.bindBuffer(gl.ARRAY_BUFFER, floor);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(quad), gl.STATIC_DRAW);
      }
    },
    draw(placed, deformed) {
      resize();
      const clouds = placed.length / INSTANCE - scene.placed, corners = deformed.length / SURFACE;
      for (const [buffer, data] of [[instances, placed], [surfaces, deformed]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
      }
      const lights = lamps(), { camera } = scene, distance = Math.hypot(...minus(eye, aim));
      const view = times(perspective(camera.fov, canvas.width / canvas.height, camera.near, camera.far), lookAt(eye, aim, [0, 0, 1]));
      const toLight = lights[0].way[3] ? unit(minus(lights[0].way.slice(0, 3), aim)) : lights[0].way.slice(0, 3);
      const reach = 1.2 * distance, above = aim.map((x, k) => x + 2 * reach * toLight[k]);
      const light = times(parallel(reach, 0, 4 * reach), lookAt(above, aim, Math.abs(toLight[2]) > 0.99 ? [0, 1, 0] : [0, 0, 1]));
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL); // the sky is at depth 1

      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      gl.viewport(0, 0, MAP, MAP);
      gl.clear(gl.DEPTH_BUFFER_BIT);
      gl.useProgram(depth.program);
      gl.uniformMatrix4fv(depth.at("view"), false, light);
      drawAll(clouds, corners);

      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.useProgram(sky.program);
      gl.depthMask(false);
      gl.uniformMatrix4fv(sky.at("back"), false, inverse(view));
      for (const [name, color] of [["zenith", scene.sky.zenith], ["horizon", scene.sky.horizon], ["nadir", scene.sky.ground]]) gl.uniform3fv(sky.at(name), color);
      for (let place = 0; place < 7; place++) gl.disableVertexAttribArray(place);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.depthMask(true);

      gl.useProgram(lit.program);
      gl.uniformMatrix4fv(lit.at("view"), false, view);
      gl.uniformMatrix4fv(lit.at("light"), false, light);
      gl.uniform3fv(lit.at("eye"), eye);
      gl.uniform3fv(lit.at("zenith"), scene.sky.zenith);
      gl.uniform3fv(lit.at("floor_color"), scene.sky.ground);
      gl.uniform1f(lit.at("ambient"), scene.sky.intensity);
      gl.uniform4fv(lit.at("lights"), lights.flatMap((l) => l.way));
      gl.uniform3fv(lit.at("powers"), lights.flatMap((l) => l.power));
      gl.uniform1i(lit.at("count"), lights.length);
      gl.uniform1i(lit.at("shadow"), 0);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, map);
      gl.uniform1f(lit.at("scale"), 0);
      drawAll(clouds, corners);
      if (scene.ground) {
        gl.uniform1f(lit.at("scale"), scene.ground.scale);
        gl.uniform3fv(lit.at("second"), scene.ground.second);
        atOrigin();
        vertices(floor, SURFACE, true);
        gl.drawArrays(gl.TRIANGLES, 0, 6);
      }
      const error = gl.getError();
      if (error !== gl.NO_ERROR) throw new Error("WebGL " + error.toString(16));
    },
  };
}
