// WebGL2: the GLSL ES 3.00 that was translated from the techniques' WGSL.
"use strict";

steradian.WebGL2 = class {
  static name = "WebGL2";

  static async open(canvas, lost) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, depth: true, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL2");
    canvas.addEventListener("webglcontextlost", (e) => { e.preventDefault(); lost("the graphics context was lost"); });
    return new this(gl);
  }

  constructor(gl) {
    this.gl = gl;
    this.depthFromMinusOne = true;
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  }

  // Textures of `size`, whose data the page may hold in less than whole rows.
  texture({ format, size }, bytes, layers) {
    const gl = this.gl, [w, h, n] = size;
    const [internal, outer, type, array] = {
      rgba16float: [gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT, Uint16Array],
      rgba32float: [gl.RGBA32F, gl.RGBA, gl.FLOAT, Float32Array],
      rg32float: [gl.RG32F, gl.RG, gl.FLOAT, Float32Array],
      rgba8unorm: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array],
      r32float: [gl.R32F, gl.RED, gl.FLOAT, Float32Array],
      r32uint: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, Uint32Array],
    }[format];
    if (Math.max(w, h) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error("the data exceed what this device's textures hold");
    const target = layers ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
    const texture = gl.createTexture(), data = new array(bytes.buffer, bytes.byteOffset, bytes.byteLength / array.BYTES_PER_ELEMENT);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(target, texture);
    if (layers) gl.texImage3D(target, 0, internal, w, h, n, 0, outer, type, data);
    else gl.texImage2D(target, 0, internal, w, h, 0, outer, type, data);
    for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, p, gl.NEAREST);
    for (const p of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, p, gl.CLAMP_TO_EDGE);
    return { texture, target };
  }

  uniform(bytes) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, bytes, gl.DYNAMIC_DRAW);
    return { buffer };
  }

  write(uniform, bytes) {
    const gl = this.gl;
    gl.bindBuffer(gl.UNIFORM_BUFFER, uniform.buffer);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, bytes);
  }

  free(resource) {
    if (resource.texture) this.gl.deleteTexture(resource.texture);
    else this.gl.deleteBuffer(resource.buffer);
  }

  async program(module) {
    const gl = this.gl, program = gl.createProgram();
    const shaders = [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].map((stage, k) => {
      const shader = gl.createShader(stage);
      gl.shaderSource(shader, module.glsl[k]);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      return shader;
    });
    gl.linkProgram(program);
    // Where the driver compiles in the background, wait without holding the page up.
    const parallel = gl.getExtension("KHR_parallel_shader_compile");
    while (parallel && !gl.isContextLost() && !gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR)) {
      await new Promise((done) => setTimeout(done, 5));
    }
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = [...shaders.map((s) => gl.getShaderInfoLog(s)), gl.getProgramInfoLog(program)];
      throw new Error("a shader was refused: " + logs.filter(Boolean).join(" ").slice(0, 500));
    }
    gl.useProgram(program);
    let unit = 0, block = 0;
    const slots = module.bindings.map((b) => {
      const names = b.glsl.filter(Boolean);
      if (b.kind === "uniform") {
        const at = block++;
        for (const name of names) {
          const index = gl.getUniformBlockIndex(program, name);
          if (index !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, index, at);
        }
        return { name: b.name, block: at };
      }
      const at = unit++;
      for (const name of names) gl.uniform1i(gl.getUniformLocation(program, name), at);
      return { name: b.name, unit: at };
    });
    return { program, slots };
  }

  bind(program, resources) {
    return program.slots.map((s) => ({ ...s, resource: resources[s.name] }));
  }

  resize(canvas, width, height) {
    canvas.width = width;
    canvas.height = height;
  }

  // Draws the backdrop first, then the objects.
  draw(list) {
    const gl = this.gl;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const { program, bound, vertices, solid } of list) {
      gl.useProgram(program.program);
      for (const { block, unit, resource } of bound) {
        if (unit === undefined) gl.bindBufferBase(gl.UNIFORM_BUFFER, block, resource.buffer);
        else {
          gl.activeTexture(gl.TEXTURE0 + unit);
          gl.bindTexture(resource.target, resource.texture);
        }
      }
      if (solid) gl.enable(gl.DEPTH_TEST);
      else gl.disable(gl.DEPTH_TEST);
      gl.drawArrays(gl.TRIANGLES, 0, vertices);
    }
  }

  // What `list` shows, as RGBA bytes.
  async read(list, width, height) {
    const gl = this.gl, pixels = new Uint8Array(4 * width * height), out = new Uint8Array(pixels.length);
    this.draw(list);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    // From the bottom row up.
    for (let y = 0, row = 4 * width; y < height; y++) out.set(pixels.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
    return out;
  }
};
