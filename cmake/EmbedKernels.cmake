# SPDX-License-Identifier: MIT
# Puts every kernels/*.cl and *.h, and the benchmarks' own, into the binary as bytes: programs are assembled without reading files.
file(GLOB kernel_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.cl ${CMAKE_SOURCE_DIR}/kernels/*.h ${CMAKE_SOURCE_DIR}/bench/*.cl)
set(embedded ${CMAKE_BINARY_DIR}/embedded_kernels.cpp)
add_custom_command(OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -DOUT=${embedded} "-DFILES=${kernel_files}" -P ${CMAKE_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${kernel_files} ${CMAKE_SOURCE_DIR}/cmake/embed.cmake VERBATIM)
add_library(clume_kernels STATIC ${embedded})
target_include_directories(clume_kernels PUBLIC ${CMAKE_SOURCE_DIR})
