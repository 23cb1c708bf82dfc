//! Light times reflectance: the filters.
