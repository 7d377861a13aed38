//! NumPy .npy arrays, read and written.
