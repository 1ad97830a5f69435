//! Pairs whose sides keep clocks of their own: momentum, rest, links, the choice of the computing side, devices.

mod clocks;
mod device;
mod ledger;
mod links;
