// Lookups: one, or three at least.
fn number(taps: f32) -> f32 {
    return select(1.0, max(ceil(taps - 1e-3), 3.0), taps > 1.001);
}

// Where lookup k of `taps` lies, of -1 ... 1.
fn place(k: f32, taps: f32) -> f32 {
    return (2.0 * k + 1.0) / taps - 1.0;
}

// Weight of a lookup.
fn tap(at: f32) -> f32 {
    return exp(-2.0 * at * at);
}

// The sum of the weights, and the factor of places that makes their variance 1.
fn spread(taps: f32) -> vec2<f32> {
    var all = 0.0;
    var square = 0.0;
    for (var k = 0.0; k < taps; k += 1.0) {
        let at = place(k, taps);
        all += tap(at);
        square += at * at * tap(at);
    }
    return vec2<f32>(all, sqrt(all / max(square, 1e-6)));
}
