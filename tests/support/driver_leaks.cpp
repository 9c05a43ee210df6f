// For tests that draw: Mesa's drivers keep a few hundred bytes until the end and are unloaded before leaks
// are looked for, so that nothing in lsan.supp can name them. These programs look for no leaks; address and
// undefined behaviour are checked as everywhere, and what is not drawing has tests of its own that do look.

extern "C" const char*
__asan_default_options();  // NOLINT(bugprone-reserved-identifier): the sanitizer's name for it.

const char* __asan_default_options() {  // NOLINT(bugprone-reserved-identifier)
  return "detect_leaks=0";
}
