// SPDX-License-Identifier: GPL-3.0-or-later
// A photon's number, on which its random numbers hang. With DISPERSION it is -1 - number once the photon has taken the
// colour of its wavelength (wavelength.glsl).
#ifdef DISPERSION
bool has_colour(Flux photon) { return photon.photon < 0.0; }
uint photon_number(Flux photon) { return uint(photon.photon < 0.0 ? -1.0 - photon.photon : photon.photon); }
Flux with_colour(Flux photon) { return Flux(photon.flux, -1.0 - float(photon_number(photon))); }
#else
uint photon_number(Flux photon) { return uint(photon.photon); }
#endif
