// SPDX-License-Identifier: MIT
// What a body means (*_body.inc.cl) where it is written for one number: FN(x) is x_s. Undone by body_end.inc.cl.
#define FN(name) name##_s
#define VF float
#define VI int
#define VU uint
#define VL ulong
#define SEL(a, b, mask) ((mask) ? (b) : (a))
#define ANY(mask) (mask)
#define AS_F(x) as_float(x)
#define AS_I(x) as_int(x)
#define AS_U(x) as_uint(x)
#define TO_I(x) ((int)(x))
#define TO_U(x) ((uint)(x))
#define TO_L(x) ((ulong)(x))
