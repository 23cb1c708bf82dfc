//! Vectors as wide as the instruction set's registers, for kernels that hold their sums in registers.

/// Most f64 that a register holds on any instruction set.
pub const MAX_F64_LANES: usize = 8;

/// A register of numbers.
pub trait Vector: Copy {
    /// What its lanes hold.
    type T: Copy;
    /// Numbers per register.
    const LANES: usize;
    /// Registers that kernels may count on.
    const REGISTERS: usize;

    /// All lanes the same.
    fn splat(x: Self::T) -> Self;
    /// The first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load(x: &[Self::T]) -> Self;
    /// Writes the first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn store(self, x: &mut [Self::T]);
    /// The numbers from the first that is aligned to a register, as registers.
    fn view(x: &mut [Self::T]) -> &mut [Self];
    /// self + b.
    fn add(self, b: Self) -> Self;
    /// self − b.
    fn sub(self, b: Self) -> Self;
    /// self · b.
    fn mul(self, b: Self) -> Self;
    /// self · b + c, fused where the instruction set has it.
    fn fma(self, b: Self, c: Self) -> Self;
    /// c − self · b, fused where the instruction set has it.
    fn fnma(self, b: Self, c: Self) -> Self;
    /// Lane k of vector i becomes lane i of vector k; as many vectors as lanes.
    fn transpose(v: &mut [Self]);
    /// Lane k is the sum over the lanes of vector k; as many vectors as lanes, which are overwritten.
    ///
    /// # Panics
    /// If there are fewer.
    fn lane_sums(v: &mut [Self]) -> Self;
    /// The sum over the lanes of each of twelve vectors, added to `sums`, which starts with twelve numbers.
    fn add_sums(v: &[Self; 12], sums: &mut [f64; 16]);
}

/// A register of f64.
pub trait Double: Vector<T = f64> {
    /// Per lane: `yes` where a = b, else self.
    fn replace_if_equal(self, a: Self, b: Self, yes: Self) -> Self;
}

/// A register of f32, which holds as many numbers as two of f64.
pub trait Single: Vector<T = f32> {
    /// The register of f64.
    type Double: Double;
    /// The register of i16.
    type Short: Short<Single = Self>;

    /// The lanes of `a`, then those of `b`, rounded.
    fn narrow(a: Self::Double, b: Self::Double) -> Self;
    /// The first lanes of a slice of finite half-precision numbers, as their bits.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load_half(x: &[u16]) -> Self;
    /// self / b.
    fn div(self, b: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The smaller; `b` where they are equal or either is NaN.
    fn min(self, b: Self) -> Self;
    /// Towards zero to a whole number; of numbers below 2^31 in size.
    fn truncate(self) -> Self;
    /// Writes whole numbers from 0 to 2^31 − 1 to the first lanes of a slice. (A conversion by `as` minds all
    /// other numbers, one lane after the other.)
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn store_whole(self, x: &mut [u32]);
    /// Per lane: `yes` where self > 0, `no` elsewhere and where self is NaN.
    fn if_positive(self, yes: Self, no: Self) -> Self;
}

/// A register of i16, two for each lane of one of f32. All of it is exact: the bits are the same on every
/// instruction set.
pub trait Short: Copy {
    /// The register of f32.
    type Single;

    /// All lanes the same.
    fn splat(x: i16) -> Self;
    /// The first lanes of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than a register.
    fn load(x: &[i16]) -> Self;
    /// self + b, without carry.
    fn add(self, b: Self) -> Self;
    /// self · b / 2^15, rounded to the nearest, upwards in the middle: b as a fraction. Not for both −2^15.
    fn fraction(self, b: Self) -> Self;
    /// The sums of the products of two neighbours each, as f32. Not for four times −2^15.
    fn pairs(self, b: Self) -> Self::Single;
}
