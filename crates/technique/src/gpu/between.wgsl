// The two entries of `count` around w, and the weight of the second.
struct Between {
    a: u32,
    b: u32,
    weight: f32,
}

fn between(w: f32, count: u32) -> Between {
    let last = count - 1u;
    let l = clamp(w, 0.0, f32(last));
    let a = min(u32(l), last);
    return Between(a, min(a + 1u, last), l - f32(a));
}
