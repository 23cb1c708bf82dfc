// The head of a list of jobs. A job shades the samples of one quad (2 x 2 samples) that see one triangle; it
// holds the quad's number, rows from the top, times 16, and a bit for each sample.
struct GpuHead {
    // Workgroups that shade the list: 16, rows of 16, 1.
    columns: u32,
    rows: GpuCounter,
    layers: u32,
    // Jobs of the list.
    jobs: GpuCounter,
    // Triangles of the object: first id, number. The backdrop has the id 0.
    first: u32,
    number: u32,
}
