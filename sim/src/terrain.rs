//! Height maps from files: 16-bit images, NumPy arrays, ESRI ASCII grids, scattered soundings.
