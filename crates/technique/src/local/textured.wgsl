
// The loop over directional and point lights, for a technique with data per texel, in the frame of the
// surface itself.
fn local_radiance(n: vec3<f32>, t: vec3<f32>, wo: vec3<f32>, p: vec3<f32>, site: Site) -> vec3<f32> {
    let frame = transpose(mat3x3<f32>(site.t.xyz, site.t.w * cross(site.n, site.t.xyz), site.n));
    let o = frame * wo;
    if !(o.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let x = local_texel(site.uv, site.footprint, o);
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < u32(technique.local_count); k++) {
        let light = local_light(k, p);
        if light.there {
            let f = local_f_cos(x, frame * light.d, o);
            let seen = light_arriving(p, site.n, light.d, light.distance);
            sum = clamp(sum + seen * f * light.e, vec3<f32>(-3.4028234e38), vec3<f32>(3.4028234e38));
        }
    }
    return sum;
}
