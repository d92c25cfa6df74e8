// SPDX-License-Identifier: MIT
// A file of the game that has nothing to do with Relume: it is of the standard that the compiler takes by itself.
#if __cplusplus >= 202002L
#error Relume has set the C++ standard of files that do not use it
#endif

int main() { return 0; }
