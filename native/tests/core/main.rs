// SPDX-License-Identifier: GPL-3.0-or-later
//! The core as others see it. One program, for each one more is linked anew.

mod bvh;
mod common;
mod photons;
mod refit;
mod watertight;
