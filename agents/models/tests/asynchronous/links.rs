//! Attachments between clocks, by ledger and by transmission lines.
