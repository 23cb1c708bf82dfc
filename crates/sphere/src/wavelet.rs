//! Haar wavelets on cube maps.
