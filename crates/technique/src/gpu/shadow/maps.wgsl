// light_arriving is the part of a light that reaches a point of unit normal n, d the unit direction to the
// light and `distance` the way to it, by depth maps: the twin of steradian_scene::shadow::ShadowMaps. A light
// has five rows of four numbers; behind the rows of all lights lie depths, four a row.
const SHADOW_STEEPEST: f32 = 10.0;

fn shadow_depth(texel: u32) -> f32 {
    return fetch_light_shadows(5u * u32(technique.shadow_lights) + texel / 4u, texel % 4u);
}

// Bias towards the light, in texels, for a receiver whose slope has this tangent.
fn shadow_bias(slope: f32) -> f32 {
    return 0.5 + 0.5 * slope;
}

// The direction at (u, v) of a face, with the component 1 along its axis.
fn shadow_face_direction(face: u32, at: vec2<f32>) -> vec3<f32> {
    let along = select(-1.0, 1.0, face % 2u == 0u);
    let axis = face / 2u;
    if axis == 0u {
        return vec3<f32>(along, at.x, at.y);
    }
    if axis == 1u {
        return vec3<f32>(at.y, along, at.x);
    }
    return vec3<f32>(at.x, at.y, along);
}

// Position on the face that shows direction d, and the face.
fn shadow_face_of(d: vec3<f32>) -> vec3<f32> {
    let a = abs(d);
    // Where components are equal, the last one decides the face.
    if a.z >= a.x && a.z >= a.y {
        return vec3<f32>(d.xy / a.z, select(4.0, 5.0, d.z < 0.0));
    }
    if a.y >= a.x {
        return vec3<f32>(d.zx / a.y, select(2.0, 3.0, d.y < 0.0));
    }
    return vec3<f32>(d.yz / a.x, select(0.0, 1.0, d.x < 0.0));
}

fn shadow_nearest(x: f32, size: f32) -> f32 {
    return clamp(floor(0.5 * (x + 1.0) * size), 0.0, size - 1.0);
}

// Position on a plane's map in texels, and height towards the light in metres.
fn shadow_place(row: u32, p: vec3<f32>) -> vec3<f32> {
    let x = shadow_row(row + 1u);
    let y = shadow_row(row + 2u);
    let z = shadow_row(row + 3u);
    let at = ((vec2<f32>(dot(x.xyz, p), dot(y.xyz, p)) - vec2<f32>(x.w, y.w)) / z.w + 1.0) * (0.5 * shadow_row(row + 4u).x);
    return vec3<f32>(at, dot(z.xyz, p));
}

// The finest of a distant light's cascades in which all taps lie.
fn shadow_widest(light: u32, p: vec3<f32>, taps: i32) -> u32 {
    var row = light;
    while shadow_row(row + 4u).z > 0.5 {
        let cell = floor(shadow_place(row, p).xy);
        let reach = f32(taps / 2);
        if all(cell >= vec2<f32>(reach)) && all(cell < vec2<f32>(shadow_row(row + 4u).x - reach)) {
            break;
        }
        row += 5u;
    }
    return row;
}

fn shadow_plane(row: u32, p: vec3<f32>, n: vec3<f32>, taps: i32) -> f32 {
    let place = shadow_place(row, p);
    let size = shadow_row(row + 4u).x;
    let first = u32(shadow_row(row + 4u).y);
    let towards = dot(shadow_row(row + 3u).xyz, n);
    let texel = 2.0 * shadow_row(row + 3u).w / size;
    let cell = clamp(floor(place.xy), vec2<f32>(-1.0), vec2<f32>(size));
    // Metres that the receiver's plane recedes from the light per metre across.
    let across = vec2<f32>(dot(shadow_row(row + 1u).xyz, n), dot(shadow_row(row + 2u).xyz, n));
    var slope = across / max(abs(towards), 1e-6) * select(1.0, -1.0, towards < 0.0);
    slope *= min(1.0, SHADOW_STEEPEST / max(length(slope), 1e-30));
    let margin = texel * shadow_bias(length(slope));
    var open = 0.0;
    for (var k = 0; k < taps * taps; k++) {
        let tap = cell + vec2<f32>(vec2<i32>(k % taps, k / taps) - taps / 2);
        let inside = all(tap >= vec2<f32>(0.0)) && all(tap < vec2<f32>(size));
        let own = place.z - dot(slope, (tap + 0.5 - place.xy) * texel);
        if !inside || shadow_depth(first + u32(tap.y) * u32(size) + u32(tap.x)) <= own + margin {
            open += 1.0;
        }
    }
    return open / f32(taps * taps);
}

fn light_arriving(point: vec3<f32>, normal: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    let n = select(normal, -normal, dot(d, normal) < 0.0);
    let p = point + n * technique.shadow_offset;
    let near = distance < 1e30;
    // The listed light that agrees best with d and `distance`.
    var best = 0u;
    var least = 3.4e38;
    for (var k = 0u; k < u32(technique.shadow_lights); k++) {
        let place = shadow_row(5u * k);
        if (place.w > 0.5) == near {
            let mismatch = length(select(place.xyz - d, point + distance * d - place.xyz, near));
            if mismatch < least {
                least = mismatch;
                best = 5u * k;
            }
        }
    }
    if least == 3.4e38 {
        return 1.0;
    }
    let taps = i32(technique.shadow_taps);
    var open = 0.0;
    if !near {
        return shadow_plane(shadow_widest(best, p, taps), p, n, taps);
    }
    let size = shadow_row(best + 4u).x;
    let first = u32(shadow_row(best + 4u).y);
    let to = p - shadow_row(best).xyz;
    let far = max(abs(to.x), max(abs(to.y), abs(to.z)));
    if far == 0.0 {
        return 1.0;
    }
    let seen = shadow_face_of(to);
    let step = 2.0 / size;
    let cosine = -dot(n, to) / length(to);
    let slope = min(sqrt(max(1.0 - cosine * cosine, 0.0)) / max(abs(cosine), 1e-3), SHADOW_STEEPEST);
    let margin = far * step * shadow_bias(slope);
    let cell = vec2<f32>(shadow_nearest(seen.x, size), shadow_nearest(seen.y, size));
    for (var k = 0; k < taps * taps; k++) {
        let tap = cell + vec2<f32>(vec2<i32>(k % taps, k / taps) - taps / 2);
        // Beyond the border of a face its extended plane leads to a texel of the neighbour.
        let other = shadow_face_of(shadow_face_direction(u32(seen.z), (tap + 0.5) * step - 1.0));
        let texel = vec2<f32>(shadow_nearest(other.x, size), shadow_nearest(other.y, size));
        let e = shadow_face_direction(u32(other.z), (texel + 0.5) * step - 1.0);
        // Depth at which this texel's ray meets the receiver's plane; a plane seen at too steep an angle is
        // treated as one that faces the light.
        let along = dot(e, n);
        let flat = far * max(abs(e.x), max(abs(e.y), abs(e.z)));
        var own = flat;
        if abs(along) * SHADOW_STEEPEST > length(e) {
            own = dot(to, n) / along;
        }
        own = select(flat, own, own > 0.0);
        if shadow_depth(first + (u32(other.z) * u32(size) + u32(texel.y)) * u32(size) + u32(texel.x)) >= own - margin {
            open += 1.0;
        }
    }
    return open / f32(taps * taps);
}
