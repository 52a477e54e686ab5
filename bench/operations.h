// SPDX-License-Identifier: MIT
// Operations of the kernels' building blocks, per lane: fma, addition, multiplication, comparison, selection, conversion and
// integer instructions count 1 each; negation, absolute value, loads, stores and addresses 0. They are those of the code:
// tests/test_roofline.cpp has clang compile each block to LLVM's intermediate code and counts along the way through it that
// takes the least, so that a share of the roofline is rather too low than too high. Multiplications, fma among them, are counted
// once more by themselves: some processors have fewer units for them.
#pragma once

#include <span>
#include <string_view>

namespace clume::bench {

struct Operations {
    double all, multiplications;  ///< the latter are among the former

    constexpr Operations(double a = 0, double m = 0) : all(a), multiplications(m) {}
    Operations operator+(const Operations& o) const { return {all + o.all, multiplications + o.multiplications}; }
    Operations operator*(double n) const { return {all * n, multiplications * n}; }
};

struct Block {
    const char* name;
    Operations operations;  ///< per lane
    int width;            ///< lanes that the code works on
    const char* defines;
    const char* code;     ///< over `a` (floats in), `out` (floats), the scene's buffers, o and d (a ray)
    bool longest = false; ///< count the longest way instead, loops once: the shorter ones are early ends
};

std::span<const Block> blocks();

/// Of the block of that name. Throws std::logic_error if there is none.
Operations operations(std::string_view block);

/// What no single block shows, counted by hand. A step from one root cell to the next (cells_next): 4 comparisons and 4 ands
/// for the axes crossed, 4 additions and 3 tests of the link, 8 for the plane, 4 fma and 6 for the exit.
inline constexpr Operations cell_step_operations{33, 4};
/// Of a tentative collision beside its blocks: depth to it, which of two primitives and its scale, the place, acceptance.
inline constexpr Operations tentative_operations{16, 4};
/// Of one child of a node of the bvh: is it there, is it near enough, is it a leaf.
inline constexpr Operations child_operations{3, 0};

}  // namespace clume::bench
