//! Devices of the command: those of `run --device`, which lead objects of a session, and of `tool`, which lead one elsewhere.
//!
//! In: the devices to serve, a scene, a session. Out: devices, threads that serve them, their reports. Never here: the phases of a tick.

use anyhow::Context;
use metachron_console::output::BadInput;
#[cfg(feature = "gamepad")]
use metachron_devices::Gamepad;
use metachron_devices::{Device, DeviceLoop, DeviceReport, Hand, HandPath, Link, LoopOptions, Served, SimulatedDevice};
use metachron_session::Session;
use metachron_world::{Scene, Spec, WorldError};

/// A kind of device, and the name of the object that it leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceWish {
    /// The kind.
    pub kind: DeviceKind,
    /// The object.
    pub object: String,
}

/// The kinds of devices that a run serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceKind {
    /// A hand that goes along the object's keyframes, at the end of a link of 2 ms.
    Simulated,
    /// The system's first gamepad.
    #[cfg(feature = "gamepad")]
    Gamepad,
}

/// Delay of a simulated device's link, seconds: that of a device on USB.
const LINK_S: f64 = 0.002;
/// The most that a simulated device gives, N, where the object says nothing.
const MOST_N: f64 = 10.0;
/// The speed at which a stick leads, m/s.
#[cfg(feature = "gamepad")]
const STICK_M_S: f64 = 0.1;

/// Reads `KIND=OBJECT`.
pub(super) fn wish(text: &str) -> Result<DeviceWish, String> {
    let (kind, object) = text.split_once('=').ok_or("expected KIND=OBJECT, such as simulated=probe")?;
    Ok(DeviceWish { kind: self::kind(kind)?, object: object.to_owned() })
}

/// Reads a kind.
pub(super) fn kind(text: &str) -> Result<DeviceKind, String> {
    let expected = if cfg!(feature = "gamepad") { "simulated or gamepad" } else { "simulated" };
    match text {
        "simulated" => Ok(DeviceKind::Simulated),
        #[cfg(feature = "gamepad")]
        "gamepad" => Ok(DeviceKind::Gamepad),
        _ => Err(format!("there is no device `{text}` here; expected {expected}")),
    }
}

/// Refuses an object that two devices are to lead: the two would take turns at where it is led, and each hand would feel the other as a contact.
pub(super) fn check(wishes: &[DeviceWish]) -> Result<(), BadInput> {
    let is_known = |(at, wish): (usize, &DeviceWish)| wishes[..at].iter().any(|before| before.object == wish.object);
    match wishes.iter().enumerate().find(|one| is_known(*one)) {
        Some((_, DeviceWish { object, .. })) => {
            Err(BadInput(format!("--device leads `{object}` twice; expected one device for each object")))
        }
        None => Ok(()),
    }
}

/// Serves devices beside a session.
///
/// # Errors
/// In virtual time, for objects that no device can lead, and where the device cannot be opened.
pub(super) fn serve(session: &Session, scene: &Scene, wishes: &[DeviceWish]) -> anyhow::Result<Vec<Served>> {
    if !wishes.is_empty() && session.is_virtual() {
        let why = "--device serves an object in real time; add --executor threads or --executor pool";
        return Err(BadInput(why.to_owned()).into());
    }
    wishes.iter().map(|wish| serve_one(session, scene, wish)).collect()
}

fn serve_one(session: &Session, scene: &Scene, wish: &DeviceWish) -> anyhow::Result<Served> {
    let refused = |error: WorldError| BadInput(format!("--device: {error}"));
    let device = open(scene, wish)?;
    let device_loop =
        DeviceLoop::new(session.world(), &wish.object, device, LoopOptions::default()).map_err(refused)?;
    Served::start(device_loop).context("a device has no thread")
}

/// The device of a wish; a simulated one is led as the scene leads its object.
///
/// # Errors
/// Where it cannot be opened.
pub(super) fn open(scene: &Scene, DeviceWish { kind, object }: &DeviceWish) -> anyhow::Result<Box<dyn Device>> {
    let member = scene.agents.iter().find(|member| member.name == *object);
    let (path, most_n) = match member.map(|member| &member.spec) {
        Some(Spec::Tool(tool)) => (HandPath::along(&tool.keyframes, tool.repeat), tool.max_force_n),
        Some(Spec::Rigid(body)) => {
            let path = body.led.as_ref().and_then(|led| HandPath::along(&led.keyframes, led.repeat));
            (Some(path.unwrap_or_else(|| HandPath::still(body.position, body.rotation))), MOST_N)
        }
        _ => (None, MOST_N),
    };
    let path = path.unwrap_or_else(|| HandPath::still(Default::default(), Default::default()));
    Ok(match kind {
        DeviceKind::Simulated => {
            let link = Link { delay_s: LINK_S, ..Link::default() };
            Box::new(SimulatedDevice::new(Hand::default(), path, link, most_n))
        }
        #[cfg(feature = "gamepad")]
        DeviceKind::Gamepad => {
            let (position_m, rotation) = path.at(0.0);
            Box::new(Gamepad::new(position_m, rotation, STICK_M_S)?)
        }
    })
}

/// Ends them.
pub(super) fn reports(served: Vec<Served>) -> Vec<DeviceReport> {
    served.into_iter().map(Served::stop).collect()
}
