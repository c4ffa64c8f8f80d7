//! Physical units (being written).
