//! The results file as its users meet it: opened by VTK's own reader and by h5py, killed while it is
//! written, refused to a second writer, cut off by a full disk, resumed.

mod brought;
mod contents;
mod insides;
mod kills;
mod names;
mod package;
mod resumed;
mod scripts;
mod tables;
mod two_grains;
mod vtk;
