//! One room per published technique.
