// light_arriving is the part of a light that reaches a point of unit normal n, d the unit direction to the
// light and `distance` the way to it, by a ray through boxes and triangles: the twin of
// steradian_scene::Bvh::occluded. Boxes are two rows of four numbers; triangles, three rows each, lie behind
// all boxes. shadow_triangle is the test of a triangle: its corners along the axes k, sheared along the ray
// (Woop, Benthin & Wald 2013, Watertight Ray/Triangle Intersection). Edges of zero count as inside.
fn shadow_triangle(row: u32, o: vec3<f32>, k: vec3<u32>, s: vec3<f32>, distance: f32) -> bool {
    var corner: array<vec3<f32>, 3>;
    for (var i = 0u; i < 3u; i++) {
        let p = shadow_row(row + i).xyz - o;
        let z = p[k.z];
        corner[i] = vec3<f32>(p[k.x] - s.x * z, p[k.y] - s.y * z, s.z * z);
    }
    let a = corner[0];
    let b = corner[1];
    let c = corner[2];
    let e = vec3<f32>(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
    let least = min(e.x, min(e.y, e.z));
    let most = max(e.x, max(e.y, e.z));
    let area = e.x + e.y + e.z;
    if (least < 0.0 && most > 0.0) || area == 0.0 {
        return false;
    }
    let w = e / area;
    let t = w.x * a.z + w.y * b.z + w.z * c.z;
    return t > 0.0 && t < distance;
}

fn light_arriving(p: vec3<f32>, n: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    let side = select(n, -n, dot(d, n) < 0.0);
    let o = p + side * technique.shadow_offset;
    let reach = distance - technique.shadow_offset;
    // No component is zero, so that no plane gives 0 times infinity.
    let inverse = 1.0 / select(d, vec3<f32>(1e-30), abs(d) < vec3<f32>(1e-30));
    let a = abs(d);
    var k = vec3<u32>(0u, 1u, 2u);
    if a.x > a.y && a.x > a.z {
        k = vec3<u32>(1u, 2u, 0u);
    } else if a.y > a.z {
        k = vec3<u32>(2u, 0u, 1u);
    }
    if d[k.z] < 0.0 {
        k = k.yxz;
    }
    let s = vec3<f32>(d[k.x], d[k.y], 1.0) / d[k.z];
    let boxes = u32(technique.shadow_boxes);
    var i = 0u;
    while i < boxes {
        let low = shadow_row(2u * i);
        let high = shadow_row(2u * i + 1u);
        let to_low = (low.xyz - o) * inverse;
        let to_high = (high.xyz - o) * inverse;
        let near = min(to_low, to_high);
        // Widened so that rounding loses no box (Ize 2013).
        let far = max(to_low, to_high) * 1.0000006;
        let enter = max(max(near.x, near.y), max(near.z, 0.0));
        let leave = min(min(far.x, far.y), min(far.z, reach));
        let met = enter <= leave;
        if met && low.w < 0.0 {
            let first = 2u * boxes + 3u * u32(high.w);
            let behind = first + 3u * u32(-low.w);
            for (var row = first; row < behind; row += 3u) {
                if shadow_triangle(row, o, k, s, reach) {
                    return 0.0;
                }
            }
        }
        if !met && low.w > 0.0 {
            i = u32(low.w);
        } else {
            i += 1u;
        }
    }
    return 1.0;
}
