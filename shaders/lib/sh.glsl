// SPDX-License-Identifier: MIT
// Real spherical harmonics, 1 to 8 bands: the arithmetic of formats/sh.h, as polynomials, because loops over arrays are
// not unrolled by every driver. A test runs both. Include with RELUME_SH_BANDS defined. Four coefficients per vector.
// The bands are written out here and not generated: a generator would be as long as what it writes and harder to read,
// and the test that compares every coefficient with formats/sh.cpp finds a wrong constant.
#define RELUME_SH_WORDS ((RELUME_SH_BANDS * RELUME_SH_BANDS + 3) / 4)

// Values of the basis functions in unit direction d, each times its band's scale; components past the last are zero.
// (c_m, s_m) are Re and Im of (x + i y)^m.
void relumeEvaluateSh(vec3 d, float scale[RELUME_SH_BANDS], out vec4 y[RELUME_SH_WORDS]) {
  float z = d.z, z2 = d.z * d.z;
  y[RELUME_SH_WORDS - 1] = vec4(0.0);
  y[0].x = scale[0] * 0.282094792;
#if RELUME_SH_BANDS > 1
  float c1 = d.x, s1 = d.y;
  y[0].z = scale[1] * 0.488602512 * z;
  float p11 = scale[1] * 0.488602512;
  y[0].w = p11 * c1;
  y[0].y = p11 * s1;
#endif
#if RELUME_SH_BANDS > 2
  float c2 = c1 * d.x - s1 * d.y, s2 = s1 * d.x + c1 * d.y;
  y[1].z = scale[2] * (0.946174696 * z2 - 0.315391565);
  float p21 = scale[2] * 1.09254843 * z;
  y[1].w = p21 * c1;
  y[1].y = p21 * s1;
  float p22 = scale[2] * 0.546274215;
  y[2].x = p22 * c2;
  y[1].x = p22 * s2;
#endif
#if RELUME_SH_BANDS > 3
  float c3 = c2 * d.x - s2 * d.y, s3 = s2 * d.x + c2 * d.y;
  y[3].x = scale[3] * (1.86588166 * z2 - 1.119529) * z;
  float p31 = scale[3] * (2.285229 * z2 - 0.457045799);
  y[3].y = p31 * c1;
  y[2].w = p31 * s1;
  float p32 = scale[3] * 1.44530572 * z;
  y[3].z = p32 * c2;
  y[2].z = p32 * s2;
  float p33 = scale[3] * 0.59004359;
  y[3].w = p33 * c3;
  y[2].y = p33 * s3;
#endif
#if RELUME_SH_BANDS > 4
  float c4 = c3 * d.x - s3 * d.y, s4 = s3 * d.x + c3 * d.y;
  y[5].x = scale[4] * ((3.70249414 * z2 - 3.17356641) * z2 + 0.317356641);
  float p41 = scale[4] * (4.6833258 * z2 - 2.00713963) * z;
  y[5].y = p41 * c1;
  y[4].w = p41 * s1;
  float p42 = scale[4] * (3.31161144 * z2 - 0.473087348);
  y[5].z = p42 * c2;
  y[4].z = p42 * s2;
  float p43 = scale[4] * 1.77013077 * z;
  y[5].w = p43 * c3;
  y[4].y = p43 * s3;
  float p44 = scale[4] * 0.625835735;
  y[6].x = p44 * c4;
  y[4].x = p44 * s4;
#endif
#if RELUME_SH_BANDS > 5
  float c5 = c4 * d.x - s4 * d.y, s5 = s4 * d.x + c4 * d.y;
  y[7].z = scale[5] * ((7.36787031 * z2 - 8.18652257) * z2 + 1.75425484) * z;
  float p51 = scale[5] * ((9.51187968 * z2 - 6.34125312) * z2 + 0.452946651);
  y[7].w = p51 * c1;
  y[7].y = p51 * s1;
  float p52 = scale[5] * (7.19030518 * z2 - 2.39676839) * z;
  y[8].x = p52 * c2;
  y[7].x = p52 * s2;
  float p53 = scale[5] * (4.40314469 * z2 - 0.489238299);
  y[8].y = p53 * c3;
  y[6].w = p53 * s3;
  float p54 = scale[5] * 2.07566231 * z;
  y[8].z = p54 * c4;
  y[6].z = p54 * s4;
  float p55 = scale[5] * 0.656382057;
  y[8].w = p55 * c5;
  y[6].y = p55 * s5;
#endif
#if RELUME_SH_BANDS > 6
  float c6 = c5 * d.x - s5 * d.y, s6 = s5 * d.x + c5 * d.y;
  y[10].z = scale[6] * (((14.6844857 * z2 - 20.0242987) * z2 + 6.67476624) * z2 - 0.317846011);
  float p61 = scale[6] * ((19.226505 * z2 - 17.4786409) * z2 + 2.91310681) * z;
  y[10].w = p61 * c1;
  y[10].y = p61 * s1;
  float p62 = scale[6] * ((15.1998868 * z2 - 8.29084734) * z2 + 0.46060263);
  y[11].x = p62 * c2;
  y[10].x = p62 * s2;
  float p63 = scale[6] * (10.1332579 * z2 - 2.76361578) * z;
  y[11].y = p63 * c3;
  y[9].w = p63 * s3;
  float p64 = scale[6] * (5.55021391 * z2 - 0.504564901);
  y[11].z = p64 * c4;
  y[9].z = p64 * s4;
  float p65 = scale[6] * 2.36661916 * z;
  y[11].w = p65 * c5;
  y[9].y = p65 * s5;
  float p66 = scale[6] * 0.683184105;
  y[12].x = p66 * c6;
  y[9].x = p66 * s6;
#endif
#if RELUME_SH_BANDS > 7
  float c7 = c6 * d.x - s6 * d.y, s7 = s6 * d.x + c6 * d.y;
  y[14].x = scale[7] * (((29.2939548 * z2 - 47.3210039) * z2 + 21.5095472) * z2 - 2.38994969) * z;
  float p71 = scale[7] * (((38.7522597 * z2 - 44.7141458) * z2 + 12.194767) * z2 - 0.451658038);
  y[14].y = p71 * c1;
  y[13].w = p71 * s1;
  float p72 = scale[7] * ((31.6410875 * z2 - 24.3392981) * z2 + 3.31899519) * z;
  y[14].z = p72 * c2;
  y[13].z = p72 * s2;
  float p73 = scale[7] * ((22.3736275 * z2 - 10.3262896) * z2 + 0.469376802);
  y[14].w = p73 * c3;
  y[13].y = p73 * s3;
  float p74 = scale[7] * (13.491805 * z2 - 3.11349347) * z;
  y[15].x = p74 * c4;
  y[13].x = p74 * s4;
  float p75 = scale[7] * (6.74590252 * z2 - 0.518915579);
  y[15].y = p75 * c5;
  y[12].w = p75 * s5;
  float p76 = scale[7] * 2.64596066 * z;
  y[15].z = p76 * c6;
  y[12].z = p76 * s6;
  float p77 = scale[7] * 0.707162733;
  y[15].w = p77 * c7;
  y[12].y = p77 * s7;
#endif
}

// Ratios Z_l / Z_0 of a cone's bands (PIC Eq. (6), App. C with the errata) times f.
void relumeConeBandRatios(float c, float f, out float ratio[RELUME_SH_BANDS]) {
  float c2 = c * c, u = f + f * c;
  ratio[0] = f;
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

// Band factors of the clamped cosine, pi times those of PIC App. B for n = 1.
const float kRelumeCosine[8] =
    float[8](3.14159265, 2.09439510, 0.78539816, 0.0, -0.13089969, 0.0, 0.04908739, 0.0);
