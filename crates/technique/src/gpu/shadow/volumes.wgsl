// light_arriving is the part of a light that reaches a point, d the unit direction to the light and
// `distance` the way to it: what shadow volumes, drawn before, left of it. A light has one row: direction or
// position, and 1 for a position.
// Bits of the samples that each light does not reach: four samples, hence four bits, a light.
var<private> shadow_blocked: array<u32, 8>;
// The samples of the pixel that this shading point represents.
var<private> shadow_samples: u32;

fn light_arriving(p: vec3<f32>, n: vec3<f32>, d: vec3<f32>, distance: f32) -> f32 {
    let near = distance < 1e30;
    // The listed light that agrees best with d and `distance`.
    var best = 0u;
    var least = 3.4e38;
    for (var k = 0u; k < u32(technique.shadow_lights); k++) {
        let place = shadow_row(k);
        if (place.w > 0.5) == near {
            let mismatch = length(select(place.xyz - d, p + distance * d - place.xyz, near));
            if mismatch < least {
                least = mismatch;
                best = k;
            }
        }
    }
    if least == 3.4e38 {
        return 1.0;
    }
    let blocked = (shadow_blocked[best / 8u] >> (4u * (best % 8u))) & shadow_samples;
    return 1.0 - f32(countOneBits(blocked)) / f32(max(countOneBits(shadow_samples), 1u));
}
