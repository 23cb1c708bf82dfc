// WebGPU: the techniques' WGSL as it is.
"use strict";

steradian.WebGPU = class {
  static name = "WebGPU";

  static async open(canvas, lost) {
    if (!navigator.gpu) throw new Error("this browser has no WebGPU");
    const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
    if (!adapter) throw new Error("no WebGPU adapter");
    const { maxTextureDimension2D, maxTextureArrayLayers } = adapter.limits;
    const device = await adapter.requestDevice({ requiredLimits: { maxTextureDimension2D, maxTextureArrayLayers } });
    const context = canvas.getContext("webgpu");
    if (!context) throw new Error("the canvas gives no WebGPU context");
    device.lost.then(() => lost("the graphics device was lost"));
    return new this(device, context);
  }

  constructor(device, context) {
    this.device = device;
    this.context = context;
    this.format = navigator.gpu.getPreferredCanvasFormat();
    this.depthFromMinusOne = false;
    context.configure({ device, format: this.format, alphaMode: "opaque" });
  }

  texture({ format, size }, bytes, layers) {
    const [width, height, n] = size, texel = { rgba16float: 8, rgba32float: 16, rg32float: 8, rgba8unorm: 4, r32float: 4, r32uint: 4 }[format];
    const texture = this.device.createTexture({
      size: [width, height, n], format, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST,
    });
    this.device.queue.writeTexture({ texture }, bytes, { bytesPerRow: width * texel, rowsPerImage: height }, [width, height, n]);
    return { texture, view: texture.createView({ dimension: layers ? "2d-array" : "2d" }) };
  }

  uniform(bytes) {
    const size = Math.ceil(bytes.byteLength / 16) * 16;
    const buffer = this.device.createBuffer({ size, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
    this.device.queue.writeBuffer(buffer, 0, bytes);
    return { buffer };
  }

  write(uniform, bytes) {
    this.device.queue.writeBuffer(uniform.buffer, 0, bytes);
  }

  free(resource) {
    (resource.texture || resource.buffer).destroy();
  }

  async program(module) {
    const device = this.device, stages = [GPUShaderStage.VERTEX, GPUShaderStage.FRAGMENT];
    const layouts = [0, 1, 2, 3].map((group) => {
      const entries = module.bindings.filter((b) => b.at[0] === group).map((b) => {
        const entry = { binding: b.at[1], visibility: b.glsl.reduce((v, name, k) => (name ? v | stages[k] : v), 0) };
        if (b.kind === "uniform") entry.buffer = { type: "uniform" };
        else entry.texture = {
          sampleType: b.kind === "uint" ? "uint" : "unfilterable-float",
          viewDimension: b.layers ? "2d-array" : "2d",
        };
        return entry;
      });
      return device.createBindGroupLayout({ entries });
    });
    const shader = device.createShaderModule({ code: module.wgsl });
    const solid = !module.entries[0].includes("sky");
    const pipeline = await device.createRenderPipelineAsync({
      layout: device.createPipelineLayout({ bindGroupLayouts: layouts }),
      vertex: { module: shader, entryPoint: module.entries[0] },
      fragment: { module: shader, entryPoint: module.entries[1], targets: [{ format: this.format }] },
      primitive: { topology: "triangle-list" },
      depthStencil: { format: "depth24plus", depthWriteEnabled: solid, depthCompare: solid ? "less" : "always" },
      multisample: { count: 4 },
    });
    return { pipeline, layouts, bindings: module.bindings };
  }

  bind(program, resources) {
    return program.layouts.map((layout, group) => {
      const entries = program.bindings.filter((b) => b.at[0] === group).map((b) => {
        const r = resources[b.name];
        return { binding: b.at[1], resource: r.buffer ? { buffer: r.buffer } : r.view };
      });
      return this.device.createBindGroup({ layout, entries });
    });
  }

  resize(canvas, width, height) {
    canvas.width = width;
    canvas.height = height;
    this.targets?.forEach((t) => t.destroy());
    const target = (format) => this.device.createTexture({
      size: [width, height], format, sampleCount: 4, usage: GPUTextureUsage.RENDER_ATTACHMENT,
    });
    this.targets = [target(this.format), target("depth24plus")];
  }

  draw(list, target = this.context.getCurrentTexture()) {
    const encoder = this.device.createCommandEncoder();
    const [colour, depth] = this.targets.map((t) => t.createView());
    const pass = encoder.beginRenderPass({
      colorAttachments: [{
        view: colour, resolveTarget: target.createView(),
        loadOp: "clear", storeOp: "discard", clearValue: [0, 0, 0, 1],
      }],
      depthStencilAttachment: { view: depth, depthLoadOp: "clear", depthStoreOp: "discard", depthClearValue: 1 },
    });
    for (const { program, bound, vertices } of list) {
      pass.setPipeline(program.pipeline);
      bound.forEach((group, k) => pass.setBindGroup(k, group));
      pass.draw(vertices);
    }
    pass.end();
    this.device.queue.submit([encoder.finish()]);
  }

  // What `list` shows, as RGBA bytes.
  async read(list, width, height) {
    const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC, row = Math.ceil(width / 64) * 256;
    const target = this.device.createTexture({ size: [width, height], format: this.format, usage });
    this.draw(list, target);
    const buffer = this.device.createBuffer({ size: row * height, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    const encoder = this.device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture: target }, { buffer, bytesPerRow: row }, [width, height]);
    this.device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const from = new Uint8Array(buffer.getMappedRange()), out = new Uint8Array(4 * width * height);
    const [red, blue] = this.format === "bgra8unorm" ? [2, 0] : [0, 2];
    for (let y = 0, to = 0; y < height; y++) {
      for (let x = 0, at = y * row; x < width; x++, at += 4, to += 4) {
        out.set([from[at + red], from[at + 1], from[at + blue], 255], to);
      }
    }
    buffer.destroy();
    target.destroy();
    return out;
  }
};
