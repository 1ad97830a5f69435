//! Imported models against closed forms, and against MuJoCo's motion of the same file.

mod equalities;
mod height_fields;
mod hostile;
mod mjcf;
mod overlaps;
mod play;
mod shapes;
mod urdf;
