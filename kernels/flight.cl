// SPDX-License-Identifier: MIT
// The distance strategy that the program was built for, under one name.
#include "strategy_decomposition.cl"
#include "strategy_delta.cl"
#include "strategy_march.cl"
#include "transmittance.cl"

#if CLUME_STRATEGY == STRATEGY_DELTA
#define flight_sample flight_delta
#elif CLUME_STRATEGY == STRATEGY_MARCH
#define flight_sample flight_march
#else
#define flight_sample flight_decomposition
#endif
