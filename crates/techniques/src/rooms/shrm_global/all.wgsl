// A layer of the cubes of all p and q.
fn map_at(c: vec3<f32>, k: u32) -> vec3<f32> {
    return fetch_maps_layer(c, k);
}

