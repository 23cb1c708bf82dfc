// From the pixel's centre to the mean of its samples in `mask`, which lies inside the triangle. Devices choose any
// covered place as the centroid: a bias of up to half a pixel in every pixel that an edge crosses.
fn gpu_offset(mask: u32) -> vec2<f32> {
    let taken = select(vec4<f32>(0.0), vec4<f32>(1.0), (vec4<u32>(mask) & vec4<u32>(1u, 2u, 4u, 8u)) > vec4<u32>(0u));
    let x = dot(taken, vec4<f32>(-0.125, 0.375, -0.375, 0.125));
    let y = dot(taken, vec4<f32>(-0.375, -0.125, 0.125, 0.375));
    return vec2<f32>(x, y) / max(dot(taken, vec4<f32>(1.0)), 1.0);
}

// Colour of a fragment that covers the samples in `mask`.
fn gpu_shown(v: GpuVarying, front: bool, mask: u32) -> vec4<f32> {
    let outside = front != (gpu_object.counts.w > 0u);
    let side = select(-1.0, 1.0, outside);
    var s = GpuPoint(v.p, v.n, v.t, v.uv, v.plane, side, v.corners, v.weights, v.extra);
    if GPU_SHARE {
        let o = gpu_offset(mask);
        s.p += o.x * dpdx(v.p) + o.y * dpdy(v.p);
        s.n += o.x * dpdx(v.n) + o.y * dpdy(v.n);
        s.t += o.x * dpdx(v.t) + o.y * dpdy(v.t);
        s.uv += o.x * dpdx(v.uv) + o.y * dpdy(v.uv);
        s.weights += o.x * dpdx(v.weights) + o.y * dpdy(v.weights);
    }
    if GPU_SHADOWED {
        // Where the view ray through the samples meets the triangle: at single samples Mesa's software adapter interpolates in
        // perspective as if they were at the pixel's centre.
        let ray = gpu_ray((floor(v.position.xy) + 0.5 + gpu_offset(mask)) / gpu_camera.film.z);
        let towards = dot(s.plane.xyz, ray.direction);
        if abs(towards) > 1e-6 {
            s.p = ray.origin + ray.direction * (dot(s.plane.xyz, gpu_position(s.corners.x) - ray.origin) / towards);
        }
        // Interpolation can move the point off the triangle by more than the offset of rays.
        s.p -= s.plane.xyz * dot(s.plane.xyz, s.p - gpu_position(s.corners.x));
    }
    gpu_shadows(vec2<u32>(v.position.xy), vec2<u32>(gpu_camera.film.xy * gpu_camera.film.z), mask);
    return vec4<f32>(gpu_radiance(s), 1.0);
}
