// SPDX-License-Identifier: MIT
// The distance strategy that the program was built for, under one name.
#include "strategy_decomposition.cl"
#include "strategy_delta.cl"
#include "strategy_march.cl"
#include "strategy_regular.cl"
#include "transmittance.cl"

#if CLUME_STRATEGY == STRATEGY_DELTA
#define flight_sample flight_delta
#elif CLUME_STRATEGY == STRATEGY_PROGRESSIVE
#define flight_sample flight_progressive
#elif CLUME_STRATEGY == STRATEGY_MARCH
#define flight_sample flight_march
#elif CLUME_STRATEGY == STRATEGY_REGULAR || CLUME_STRATEGY == STRATEGY_REGULAR_LINEAR
#define flight_sample flight_regular
#elif CLUME_STRATEGY == STRATEGY_MARCH_ANALYTIC
#define flight_sample flight_march_analytic
#else
#define flight_sample flight_decomposition
#endif
