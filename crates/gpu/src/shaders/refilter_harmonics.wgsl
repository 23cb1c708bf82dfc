// Projection to real spherical harmonics in fixed order, and synthesis. With normalised
// P_lm = A_lm z P_{l-1,m} - B_lm P_{l-2,m} (sin^m theta left to (x + iy)^m); A_mm holds P_mm itself, sqrt 2 within.

const MOST_BANDS: u32 = 16u;

// A cube's low bands: a thread takes one m and `job.at.z` samples; sums lie chunk after chunk.
@compute @workgroup_size(64)
fn refilter_project(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let bands = job.tables.w;
    let n = job.span.w;
    let m = k % bands;
    let chunk = k / bands;
    let count = 6u * (n + 1u) * (n + 1u);
    var plus: array<vec3<f32>, MOST_BANDS>;
    var minus: array<vec3<f32>, MOST_BANDS>;
    let last = min((chunk + 1u) * job.at.z, count);
    for (var i = chunk * job.at.z; i < last; i++) {
        let at = lattice(i, n);
        let s = tables[job.tables.x + at.y].xy;
        let t = tables[job.tables.x + at.z].xy;
        let inverse = inverseSqrt(1.0 + s.x * s.x + t.x * t.x);
        let d = from_face(at.x, vec3<f32>(s.x, t.x, 1.0)) * inverse;
        let l_here = maps[job.at.y + i].xyz * (job.a.x * s.y * t.y * inverse * inverse * inverse);
        var turn = vec2<f32>(1.0, 0.0);
        for (var q = 0u; q < m; q++) {
            turn = vec2<f32>(turn.x * d.x - turn.y * d.y, turn.x * d.y + turn.y * d.x);
        }
        let c = l_here * turn.x;
        let e = l_here * turn.y;
        var before = 0.0;
        var p = 0.0;
        for (var l = m; l < bands; l++) {
            let ab = tables[job.tables.y + l * l + l + m].xy;
            let next = select(ab.x * d.z * p - ab.y * before, ab.x, l == m);
            before = p;
            p = next;
            plus[l] += p * c;
            minus[l] += p * e;
        }
    }
    let to = job.at.x + chunk * bands * bands;
    for (var l = m; l < bands; l++) {
        harmonics[to + l * l + l + m] = vec4<f32>(plus[l], 0.0);
        if m > 0u {
            harmonics[to + l * l + l - m] = vec4<f32>(minus[l], 0.0);
        }
    }
}

// Sums of `job.at.z` neighbours of `job.at.w` each, times 1 or (the last time) the factor of the band.
@compute @workgroup_size(64)
fn refilter_sum(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let count = job.tables.w * job.tables.w;
    let group = k / count;
    let i = k % count;
    let last = min((group + 1u) * job.at.z, job.at.w);
    var sum = vec3<f32>(0.0);
    for (var j = group * job.at.z; j < last; j++) {
        sum += harmonics[job.at.y + j * count + i].xyz;
    }
    if job.a.x > 0.5 {
        sum *= tables[job.tables.x + u32(sqrt(f32(i) + 0.5))].x;
    }
    harmonics[job.at.x + k] = vec4<f32>(sum, 0.0);
}

// Sum over bands of r_l c_lm Y_lm(d); r_l in `tables` at z.
fn harmonic_sum(d: vec3<f32>) -> vec3<f32> {
    let bands = job.tables.w;
    var sum = vec3<f32>(0.0);
    var turn = vec2<f32>(1.0, 0.0);
    for (var m = 0u; m < bands; m++) {
        var before = 0.0;
        var p = 0.0;
        for (var l = m; l < bands; l++) {
            let ab = tables[job.tables.y + l * l + l + m].xy;
            let next = select(ab.x * d.z * p - ab.y * before, ab.x, l == m);
            before = p;
            p = next;
            var c = turn.x * harmonics[l * l + l + m].xyz;
            if m > 0u {
                c += turn.y * harmonics[l * l + l - m].xyz;
            }
            sum += tables[job.tables.z + l].x * p * c;
        }
        turn = vec2<f32>(turn.x * d.x - turn.y * d.y, turn.x * d.y + turn.y * d.x);
    }
    return sum;
}

// One column of the symmetric matrix M of n^T M n (Ramamoorthi & Hanrahan 2001, eqs 11-12), times a band's factor and
// the channel's, turned by the rotation whose columns are in `tables`.
@compute @workgroup_size(64)
fn refilter_quadric(@builtin(global_invocation_id) id: vec3<u32>) {
    let k = job.span.x + id.x;
    if k >= job.span.y {
        return;
    }
    let points = u32(extras[0].x);
    let first = 2u + 2u * points + 2u * u32(extras[0].y);
    let r = mat3x3<f32>(tables[job.tables.x].xyz, tables[job.tables.x + 1u].xyz, tables[job.tables.x + 2u].xyz);
    let gain = tables[job.tables.x + 3u][k];
    var c: array<f32, 9>;
    for (var i = 0u; i < 9u; i++) {
        let band = select(select(2u, 1u, i < 4u), 0u, i < 1u);
        let scale = gain * tables[job.tables.z + band].x;
        c[i] = scale * (harmonics[i][k] + extras[first + i][k]);
    }
    let y0 = 0.28209479177387814;
    let y1 = 0.5 * 0.48860251190291992;
    let y2 = 0.5 * 1.0925484305920792;
    let y20 = 0.31539156525252005;
    let square = mat3x3<f32>(
        vec3<f32>(y2 * c[8] - y20 * c[6], y2 * c[4], y2 * c[7]),
        vec3<f32>(y2 * c[4], -y2 * c[8] - y20 * c[6], y2 * c[5]),
        vec3<f32>(y2 * c[7], y2 * c[5], 2.0 * y20 * c[6]),
    );
    let turned = r * square * transpose(r);
    let linear = r * (y1 * vec3<f32>(c[3], c[1], c[2]));
    let to = job.at.x + 4u * k;
    harmonics[to] = vec4<f32>(turned[0], linear.x);
    harmonics[to + 1u] = vec4<f32>(turned[1], linear.y);
    harmonics[to + 2u] = vec4<f32>(turned[2], linear.z);
    harmonics[to + 3u] = vec4<f32>(linear, y0 * c[0]);
}
