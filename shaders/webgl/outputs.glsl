// SPDX-License-Identifier: MIT
// Writes relumeOut[i] = RELUME_OUTPUT(i) for all RELUME_OUTPUTS: GLSL ES 3.00 wants constants for indices of outputs.
relumeOut[0] = RELUME_OUTPUT(0);
#if RELUME_OUTPUTS > 1
relumeOut[1] = RELUME_OUTPUT(1);
#endif
#if RELUME_OUTPUTS > 2
relumeOut[2] = RELUME_OUTPUT(2);
#endif
#if RELUME_OUTPUTS > 3
relumeOut[3] = RELUME_OUTPUT(3);
#endif
#if RELUME_OUTPUTS > 4
relumeOut[4] = RELUME_OUTPUT(4);
#endif
#if RELUME_OUTPUTS > 5
relumeOut[5] = RELUME_OUTPUT(5);
#endif
#if RELUME_OUTPUTS > 6
relumeOut[6] = RELUME_OUTPUT(6);
#endif
#if RELUME_OUTPUTS > 7
relumeOut[7] = RELUME_OUTPUT(7);
#endif
