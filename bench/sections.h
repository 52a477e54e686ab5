// SPDX-License-Identifier: MIT
// The sections of `clume bench`. Each asks the session which of its items are wanted, measures those and records them.
#pragma once

#include <filesystem>

#include "bench/session.h"

namespace clume::bench {

void bench_scenes_section(Session& session);   ///< compare_host.cpp
void bench_peaks_section(Session& session);    ///< peaks.cpp
void bench_kernels_section(Session& session);  ///< kernels.cpp
/// roofline_report.cpp: what those two measured, into tables of DOCS/performance.md. Throws RenderError.
void write_roofline(Session& session, const std::filesystem::path& docs);
void bench_specialisation_section(Session& session);
void bench_lamps_section(Session& session);
void bench_samplers_section(Session& session);
void bench_scaling_section(Session& session);
void bench_adaptive_section(Session& session);
void bench_devices_section(Session& session);
void bench_work_section(Session& session);     ///< work_fit.cpp
/// study.cpp; only with Options::study.
void bench_study_section(Session& session);

}  // namespace clume::bench
