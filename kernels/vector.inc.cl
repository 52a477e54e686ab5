// SPDX-License-Identifier: MIT
// What a body means (*_body.inc.cl) where it is written for a vector of CLUME_WIDTH: FN(x) is x_v. Undone by body_end.inc.cl.
#define FN(name) name##_v
#define VF vfloat
#define VI vint
#define VU vuint
#define VL vulong
#define SEL(a, b, mask) vselect(a, b, mask)
#define ANY(mask) vany(mask)
#define AS_F(x) as_vfloat(x)
#define AS_I(x) as_vint(x)
#define AS_U(x) as_vuint(x)
#define TO_I(x) to_vint(x)
#define TO_U(x) to_vuint(x)
#define TO_L(x) to_vulong(x)
