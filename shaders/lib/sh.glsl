// SPDX-License-Identifier: MIT
// Real spherical harmonics, 1 to 8 bands: the arithmetic of formats/sh.h, as polynomials, because loops over arrays are
// not unrolled by every driver. A test runs both. Include with RELUME_SH_BANDS defined.
#define RELUME_SH_COUNT (RELUME_SH_BANDS * RELUME_SH_BANDS)

// Values of the basis functions in unit direction d. (c_m, s_m) are Re and Im of (x + i y)^m.
void relumeEvaluateSh(vec3 d, out float y[RELUME_SH_COUNT]) {
  float z = d.z, z2 = d.z * d.z;
  y[0] = 0.282094792;
#if RELUME_SH_BANDS > 1
  float c1 = d.x, s1 = d.y;
  y[2] = 0.488602512 * z;
  y[3] = 0.488602512 * c1;
  y[1] = 0.488602512 * s1;
#endif
#if RELUME_SH_BANDS > 2
  float c2 = c1 * d.x - s1 * d.y, s2 = s1 * d.x + c1 * d.y;
  y[6] = (0.946174696 * z2 - 0.315391565);
  float p21 = 1.09254843 * z;
  y[7] = p21 * c1;
  y[5] = p21 * s1;
  y[8] = 0.546274215 * c2;
  y[4] = 0.546274215 * s2;
#endif
#if RELUME_SH_BANDS > 3
  float c3 = c2 * d.x - s2 * d.y, s3 = s2 * d.x + c2 * d.y;
  y[12] = z * (1.86588166 * z2 - 1.119529);
  float p31 = (2.285229 * z2 - 0.457045799);
  y[13] = p31 * c1;
  y[11] = p31 * s1;
  float p32 = 1.44530572 * z;
  y[14] = p32 * c2;
  y[10] = p32 * s2;
  y[15] = 0.59004359 * c3;
  y[9] = 0.59004359 * s3;
#endif
#if RELUME_SH_BANDS > 4
  float c4 = c3 * d.x - s3 * d.y, s4 = s3 * d.x + c3 * d.y;
  y[20] = ((3.70249414 * z2 - 3.17356641) * z2 + 0.317356641);
  float p41 = z * (4.6833258 * z2 - 2.00713963);
  y[21] = p41 * c1;
  y[19] = p41 * s1;
  float p42 = (3.31161144 * z2 - 0.473087348);
  y[22] = p42 * c2;
  y[18] = p42 * s2;
  float p43 = 1.77013077 * z;
  y[23] = p43 * c3;
  y[17] = p43 * s3;
  y[24] = 0.625835735 * c4;
  y[16] = 0.625835735 * s4;
#endif
#if RELUME_SH_BANDS > 5
  float c5 = c4 * d.x - s4 * d.y, s5 = s4 * d.x + c4 * d.y;
  y[30] = z * ((7.36787031 * z2 - 8.18652257) * z2 + 1.75425484);
  float p51 = ((9.51187968 * z2 - 6.34125312) * z2 + 0.452946651);
  y[31] = p51 * c1;
  y[29] = p51 * s1;
  float p52 = z * (7.19030518 * z2 - 2.39676839);
  y[32] = p52 * c2;
  y[28] = p52 * s2;
  float p53 = (4.40314469 * z2 - 0.489238299);
  y[33] = p53 * c3;
  y[27] = p53 * s3;
  float p54 = 2.07566231 * z;
  y[34] = p54 * c4;
  y[26] = p54 * s4;
  y[35] = 0.656382057 * c5;
  y[25] = 0.656382057 * s5;
#endif
#if RELUME_SH_BANDS > 6
  float c6 = c5 * d.x - s5 * d.y, s6 = s5 * d.x + c5 * d.y;
  y[42] = (((14.6844857 * z2 - 20.0242987) * z2 + 6.67476624) * z2 - 0.317846011);
  float p61 = z * ((19.226505 * z2 - 17.4786409) * z2 + 2.91310681);
  y[43] = p61 * c1;
  y[41] = p61 * s1;
  float p62 = ((15.1998868 * z2 - 8.29084734) * z2 + 0.46060263);
  y[44] = p62 * c2;
  y[40] = p62 * s2;
  float p63 = z * (10.1332579 * z2 - 2.76361578);
  y[45] = p63 * c3;
  y[39] = p63 * s3;
  float p64 = (5.55021391 * z2 - 0.504564901);
  y[46] = p64 * c4;
  y[38] = p64 * s4;
  float p65 = 2.36661916 * z;
  y[47] = p65 * c5;
  y[37] = p65 * s5;
  y[48] = 0.683184105 * c6;
  y[36] = 0.683184105 * s6;
#endif
#if RELUME_SH_BANDS > 7
  float c7 = c6 * d.x - s6 * d.y, s7 = s6 * d.x + c6 * d.y;
  y[56] = z * (((29.2939548 * z2 - 47.3210039) * z2 + 21.5095472) * z2 - 2.38994969);
  float p71 = (((38.7522597 * z2 - 44.7141458) * z2 + 12.194767) * z2 - 0.451658038);
  y[57] = p71 * c1;
  y[55] = p71 * s1;
  float p72 = z * ((31.6410875 * z2 - 24.3392981) * z2 + 3.31899519);
  y[58] = p72 * c2;
  y[54] = p72 * s2;
  float p73 = ((22.3736275 * z2 - 10.3262896) * z2 + 0.469376802);
  y[59] = p73 * c3;
  y[53] = p73 * s3;
  float p74 = z * (13.491805 * z2 - 3.11349347);
  y[60] = p74 * c4;
  y[52] = p74 * s4;
  float p75 = (6.74590252 * z2 - 0.518915579);
  y[61] = p75 * c5;
  y[51] = p75 * s5;
  float p76 = 2.64596066 * z;
  y[62] = p76 * c6;
  y[50] = p76 * s6;
  y[63] = 0.707162733 * c7;
  y[49] = 0.707162733 * s7;
#endif
}

// Ratios Z_l / Z_0 of a cone's bands (PIC Eq. (6), App. C with the errata).
void relumeConeBandRatios(float c, out float ratio[RELUME_SH_BANDS]) {
  float c2 = c * c, u = 1.0 + c;
  ratio[0] = 1.0;
#if RELUME_SH_BANDS > 1
  ratio[1] = u * 0.5;
#endif
#if RELUME_SH_BANDS > 2
  ratio[2] = c * u * 0.5;
#endif
#if RELUME_SH_BANDS > 3
  ratio[3] = u * (5.0 * c2 - 1.0) * 0.125;
#endif
#if RELUME_SH_BANDS > 4
  ratio[4] = c * u * (7.0 * c2 - 3.0) * 0.125;
#endif
#if RELUME_SH_BANDS > 5
  ratio[5] = u * ((21.0 * c2 - 14.0) * c2 + 1.0) * 0.0625;
#endif
#if RELUME_SH_BANDS > 6
  ratio[6] = c * u * ((33.0 * c2 - 30.0) * c2 + 5.0) * 0.0625;
#endif
#if RELUME_SH_BANDS > 7
  ratio[7] = u * (((429.0 * c2 - 495.0) * c2 + 135.0) * c2 - 5.0) * 0.0078125;
#endif
}

// Band of coefficient i.
const int kRelumeBandOf[64] = int[64](
    0, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5,
    5, 5, 5, 5, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7);

// Band factors of the clamped cosine, pi times those of PIC App. B for n = 1.
const float kRelumeCosine[8] =
    float[8](3.14159265, 2.09439510, 0.78539816, 0.0, -0.13089969, 0.0, 0.04908739, 0.0);
