// The lobe of a point, whose numbers begin at plane k.
fn point_lobe(k: u32, i: u32, count: u32) -> Lobe {
    return Lobe(
        points[k * count + i],
        points[(k + 1u) * count + i],
        points[(k + 2u) * count + i],
        point_vector(k + 3u, i, count),
        point_vector(k + 6u, i, count),
        point_vector(k + 9u, i, count),
    );
}
