//! The loop that joins the rooms: gather, choose, draw, measure.
