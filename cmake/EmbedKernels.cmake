# SPDX-License-Identifier: MIT
# Puts every kernels/*.cl and *.h into the binary as bytes, so that programs are assembled without reading files at run time.
file(GLOB kernel_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.cl ${CMAKE_SOURCE_DIR}/kernels/*.h)
set(embedded ${CMAKE_BINARY_DIR}/embedded_kernels.cpp)
add_custom_command(OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -DOUT=${embedded} "-DFILES=${kernel_files}" -P ${CMAKE_SOURCE_DIR}/cmake/embed.cmake
    DEPENDS ${kernel_files} ${CMAKE_SOURCE_DIR}/cmake/embed.cmake VERBATIM)
add_library(clume_kernels STATIC ${embedded})
target_include_directories(clume_kernels PUBLIC ${CMAKE_SOURCE_DIR})
