// SPDX-License-Identifier: MIT
// Undoes scalar.inc.cl and vector.inc.cl.
#undef FN
#undef VF
#undef VI
#undef VU
#undef VL
#undef SEL
#undef ANY
#undef AS_F
#undef AS_I
#undef AS_U
#undef TO_I
#undef TO_U
#undef TO_L
