// SPDX-License-Identifier: MIT
// The distance strategy that the program was built for, under one name.
#include "strategy_decomposition.cl"
#include "strategy_delta.cl"
#include "strategy_march.cl"
#include "strategy_regular.cl"
#include "transmittance.cl"
#include "grid_flight.cl"

#if CLUME_STRATEGY == STRATEGY_DELTA
#define mixture_flight flight_delta
#elif CLUME_STRATEGY == STRATEGY_PROGRESSIVE
#define mixture_flight flight_progressive
#elif CLUME_STRATEGY == STRATEGY_MARCH
#define mixture_flight flight_march
#elif CLUME_STRATEGY == STRATEGY_REGULAR || CLUME_STRATEGY == STRATEGY_REGULAR_LINEAR
#define mixture_flight flight_regular
#elif CLUME_STRATEGY == STRATEGY_MARCH_ANALYTIC
#define mixture_flight flight_march_analytic
#else
#define mixture_flight flight_decomposition
#endif

/// The next collision before t_end: the mixture's flight and every grid's, the nearest of all. Only the mixture's may pause;
/// grids then fly when it is over.
static int flight_sample(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
#if CLUME_MIXTURE
    int result = mixture_flight(o, d, t_end, f, r, SCENE);
#else
    int result = FLIGHT_ESCAPED;
#endif
#if CLUME_GRIDS
    if (result != FLIGHT_PAUSED) result = grids_fly(result, o, d, t_end, f, r, SCENE);
#endif
    return result;
}

/// The same, however often the mixture's flight pauses.
static int flight_to_end(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    int result;
    do result = flight_sample(o, d, t_end, f, r, SCENE);
    while (result == FLIGHT_PAUSED);
    return result;
}
