// SPDX-License-Identifier: GPL-3.0-or-later
// Where something disperses light each path has one wavelength, drawn by hash, by which all that disperses bends it.
// A path is white until it meets such a lobe for the first time; there it takes the wavelength's colour, of which the
// mean over wavelengths is white.
#include "lib/cauchy.glsl"
#include "lib/rng.glsl"
#include "made/spectrum.glsl"
#ifdef EYE
#include "lib/chain_density.glsl"
#include "lib/pixel.glsl"
#else
#include "lib/photon_number.glsl"
#endif

vec3 path_colour = vec3(1.0);  // that a lobe which disperses gives the path

// A uniform number in [0, 1), of which the wavelength is a function; of the eye's path one of a sequence that fills
// the interval evenly from pass to pass (steps of the golden ratio, times 2^32).
float wavelength_number() {
#ifdef EYE
    float start = random4(seed, 0u, uint(pixel_number(load_pixel().at)), DIMENSION_WAVELENGTH).x;
    return fract(start + float((2654435769u * pass_index) >> 8u) * (1.0 / 16777216.0));
#else
    return random4(seed, pass_index + photon_part(load_flux()), photon_number(load_flux()), DIMENSION_WAVELENGTH).y;
#endif
}

bool path_has_colour() {
#ifdef EYE
    return has_colour(load_throughput());
#else
    return has_colour(load_flux());
#endif
}

void set_wavelength() {
    float at = wavelength_number() * float(BANDS);
    int band = min(int(at), BANDS - 1);
    cauchy = cauchy_at(mix(BAND_ENDS[band], BAND_ENDS[band + 1], at - float(band)));
    path_colour = path_has_colour() ? vec3(1.0) : BAND_COLOURS[band];
}
