//! Pairs whose sides keep clocks of their own: momentum, rest, links, who computes, devices.

mod clocks;
mod device;
mod ledger;
mod links;
