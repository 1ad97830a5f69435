//! Pictures of a world by the engine's own renderer, without a window.
//!
//! In: a world, a camera, a size. Out: the colours or the depths of all pixels. Never here: the scene's drawing.

use crate::camera::{Shot, Viewpoint};
use crate::home::Home;
use crate::raised;
use metachron::render::{Camera, Gpu, GpuError, Offscreen, Picture, RendererOptions, Size};
use metachron::session::WorldView;
use metachron::world::{Scene, World};
use numpy::ndarray::{Array2, Array3, ShapeError};
use numpy::{PyArray, PyArray2, PyArray3};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The screen of all worlds of the process: an adapter is opened once, with the first picture.
static SCREEN: Mutex<Option<Screen>> = Mutex::new(None);

/// The adapter's threads are in the process that opened it.
struct Screen {
    offscreen: Offscreen,
    home: Home,
}

/// The pictures of one world.
pub struct Pictures {
    scene: Scene,
    /// The view of the world, once a picture was asked for.
    view: Mutex<Option<WorldView>>,
}

impl Pictures {
    /// The pictures of a world that is started from `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self { scene: scene.clone(), view: Mutex::new(None) }
    }

    /// The colours that a camera sees: height, width, RGBA.
    pub fn colours<'py>(&self, py: Python<'py>, world: &World, shot: &Shot) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let pixels = py.detach(|| {
            self.draw(world, shot, |screen, picture, camera| {
                screen.render(picture, camera)?;
                Ok(screen.read_back()?.into_raw())
            })
        })?;
        let pixels = Array3::from_shape_vec((shot.height as usize, shot.width as usize, 4), pixels);
        Ok(PyArray::from_owned_array(py, pixels.map_err(misshapen)?))
    }

    /// The depths that it sees, metres from the eye's plane: height, width.
    pub fn depths<'py>(&self, py: Python<'py>, world: &World, shot: &Shot) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let image = py.detach(|| self.draw(world, shot, |screen, picture, camera| screen.depths(picture, camera)))?;
        let depths = Array2::from_shape_vec((shot.height as usize, shot.width as usize), image.depths_m);
        Ok(PyArray::from_owned_array(py, depths.map_err(misshapen)?))
    }

    fn draw<T>(
        &self,
        world: &World,
        shot: &Shot,
        draw: impl FnOnce(&mut Offscreen, &Picture, &Camera) -> Result<T, GpuError>,
    ) -> PyResult<T> {
        let mut view = locked(&self.view);
        let view = view.get_or_insert_with(|| WorldView::new(world, &self.scene));
        let size = Size { width: shot.width, height: shot.height };
        let camera = match &shot.from {
            Viewpoint::Named(name) => view.camera(name.as_deref()).map_err(|error| raised::camera(&error))?,
            Viewpoint::Free { eye, look_at, fov } => Camera::looking(*eye, *look_at, *fov),
        };
        let picture = view.compose(&camera, size);
        with_screen(size, |screen| draw(screen, picture, &camera))
    }
}

/// Lets something be drawn at this size. A screen that has failed is made anew for the next picture.
fn with_screen<T>(size: Size, draw: impl FnOnce(&mut Offscreen) -> Result<T, GpuError>) -> PyResult<T> {
    let mut kept = locked(&SCREEN);
    kept.as_ref().map_or(Ok(()), |screen| screen.home.check("what draws"))?;
    let before = kept.take().map(|screen| screen.offscreen);
    let (offscreen, drawn) = drawn_at(size, before, draw).map_err(|error| raised::drawing(&error))?;
    *kept = Some(Screen { offscreen, home: Home::here() });
    Ok(drawn)
}

fn drawn_at<T>(
    size: Size,
    before: Option<Offscreen>,
    draw: impl FnOnce(&mut Offscreen) -> Result<T, GpuError>,
) -> Result<(Offscreen, T), GpuError> {
    let mut screen = match before {
        Some(screen) if screen.size() == size => screen,
        Some(screen) => screen.resized(size)?,
        None => Offscreen::new(Gpu::headless()?, size, RendererOptions::STILL)?,
    };
    let drawn = draw(&mut screen)?;
    Ok((screen, drawn))
}

fn misshapen(error: ShapeError) -> PyErr {
    PyRuntimeError::new_err(format!("the picture is of another size than asked for: {error}"))
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
