// Stands between a program and the system (LD_PRELOAD): counts write-like calls on files whose path contains FAULT_MATCH and does FAULT_KIND
// at call FAULT_AT, FAULT_TIMES in a row: kill_before, kill_half (half of a write is done), kill_after, or fail as enospc, eio, edquot …
// FAULT_LOG=file logs each counted call: "n op path off len". FAULT_DATA=1: also logs data for power-loss replay (binary).
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/file.h>
#include <unistd.h>
#include <pthread.h>

static char names[4096][512];
static const char *match; static long at = -1; static const char *kind = ""; static int logfd = -1; static int data = 0;
static long counter = 0; static long times = 1; static int ready = 0;
static int flock_errno = 0;
static void init(void) {
  if (ready) return; ready = 1;
  match = getenv("FAULT_MATCH"); const char *a = getenv("FAULT_AT"); if (a) at = atol(a);
  kind = getenv("FAULT_KIND") ? getenv("FAULT_KIND") : "";
  const char *t = getenv("FAULT_TIMES"); if (t) times = atol(t);
  data = getenv("FAULT_DATA") != NULL;
  if (getenv("FAULT_FLOCK")) flock_errno = atoi(getenv("FAULT_FLOCK"));
  const char *l = getenv("FAULT_LOG");
  if (l) { logfd = syscall(SYS_openat, AT_FDCWD, l, O_WRONLY|O_CREAT|O_TRUNC|O_CLOEXEC, 0644); if (logfd >= 0 && logfd < 900) { int n = fcntl(logfd, F_DUPFD_CLOEXEC, 900); if (n >= 0) { close(logfd); logfd = n; } } }
}
static int wanted(const char *p) { return match && p && *p && strstr(p, match) != NULL; }
static const char *name(int fd) { return fd >= 0 && fd < 4096 ? names[fd] : ""; }
static void note(int fd, const char *p) { init(); if (fd >= 0 && fd < 4096) { if (wanted(p)) { strncpy(names[fd], p, 511); names[fd][511] = 0; } else names[fd][0] = 0; } }
static void die(void) { syscall(SYS_kill, getpid(), SIGKILL); for (;;) pause(); }
// returns: 0 go on, 1 do half then die, 2 after do then die, -errno fail, 3 short write
static int step(const char *op, const char *p, long off, long len, const void *bytes) {
  long n = __sync_add_and_fetch(&counter, 1);
  if (logfd >= 0) { char b[800]; int k = snprintf(b, sizeof b, "%ld %s %s %ld %ld\n", n, op, p, off, len); syscall(SYS_write, logfd, b, k);
    if (data && bytes && len > 0) syscall(SYS_write, logfd, bytes, len); }
  if (at < 0 || n < at || n >= at + times) return 0;
  if (!strcmp(kind, "kill_before")) die();
  if (!strcmp(kind, "kill_half")) return 1;
  if (!strcmp(kind, "kill_after")) return 2;
  if (!strcmp(kind, "enospc")) return -ENOSPC;
  if (!strcmp(kind, "eio")) return -EIO;
  if (!strcmp(kind, "edquot")) return -EDQUOT;
  if (!strcmp(kind, "erofs")) return -EROFS;
  if (!strcmp(kind, "eintr")) return -EINTR;
  if (!strcmp(kind, "short")) return 3;
  return 0;
}
#define REAL(r, n, ...) static r (*real)(__VA_ARGS__); if (!real) real = dlsym(RTLD_NEXT, n)
int open(const char *p, int f, ...) { va_list v; va_start(v, f); mode_t m = va_arg(v, int); va_end(v); REAL(int, "open", const char*, int, ...); int fd = real(p, f, m); note(fd, p); return fd; }
int open64(const char *p, int f, ...) { va_list v; va_start(v, f); mode_t m = va_arg(v, int); va_end(v); REAL(int, "open64", const char*, int, ...);
  init(); if ((f & (O_CREAT|O_TRUNC)) && wanted(p)) { int s = step((f & O_TRUNC) ? "trunc" : "creat", p, 0, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int fd = real(p, f, m); if (s == 2) die(); note(fd, p); return fd; }
  int fd = real(p, f, m); note(fd, p); return fd; }
int openat(int d, const char *p, int f, ...) { va_list v; va_start(v, f); mode_t m = va_arg(v, int); va_end(v); REAL(int, "openat", int, const char*, int, ...); int fd = real(d, p, f, m); note(fd, p); return fd; }
int openat64(int d, const char *p, int f, ...) { va_list v; va_start(v, f); mode_t m = va_arg(v, int); va_end(v); REAL(int, "openat64", int, const char*, int, ...); int fd = real(d, p, f, m); note(fd, p); return fd; }
int dup(int o) { REAL(int, "dup", int); int fd = real(o); if (fd >= 0 && fd < 4096 && o >= 0 && o < 4096) strcpy(names[fd], names[o]); return fd; }
int close(int fd) { REAL(int, "close", int); if (fd >= 0 && fd < 4096) names[fd][0] = 0; return real(fd); }
ssize_t write(int fd, const void *b, size_t n) { REAL(ssize_t, "write", int, const void*, size_t); init();
  if (!*name(fd)) return real(fd, b, n); off_t o = lseek(fd, 0, SEEK_CUR); int s = step("write", name(fd), o, n, b);
  if (s < 0) { errno = -s; return -1; } if (s == 1) { real(fd, b, n / 2); die(); } if (s == 3 && n > 1) return real(fd, b, n / 2);
  ssize_t r = real(fd, b, n); if (s == 2) die(); return r; }
static ssize_t pw(int fd, const void *b, size_t n, off_t o, ssize_t (*real)(int, const void*, size_t, off_t)) { init();
  if (!*name(fd)) return real(fd, b, n, o); int s = step("pwrite", name(fd), o, n, b);
  if (s < 0) { errno = -s; return -1; } if (s == 1) { real(fd, b, n / 2, o); die(); } if (s == 3 && n > 1) return real(fd, b, n / 2, o);
  ssize_t r = real(fd, b, n, o); if (s == 2) die(); return r; }
ssize_t pwrite(int fd, const void *b, size_t n, off_t o) { REAL(ssize_t, "pwrite", int, const void*, size_t, off_t); return pw(fd, b, n, o, real); }
ssize_t pwrite64(int fd, const void *b, size_t n, off64_t o) { REAL(ssize_t, "pwrite64", int, const void*, size_t, off_t); return pw(fd, b, n, o, real); }
int ftruncate(int fd, off_t l) { REAL(int, "ftruncate", int, off_t); init(); if (*name(fd)) { int s = step("ftruncate", name(fd), l, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(fd, l); if (s == 2) die(); return r; } return real(fd, l); }
int ftruncate64(int fd, off64_t l) { REAL(int, "ftruncate64", int, off64_t); init(); if (*name(fd)) { int s = step("ftruncate", name(fd), l, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(fd, l); if (s == 2) die(); return r; } return real(fd, l); }
int fsync(int fd) { REAL(int, "fsync", int); init(); if (*name(fd)) { int s = step("fsync", name(fd), 0, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(fd); if (s == 2) die(); return r; } return real(fd); }
int fdatasync(int fd) { REAL(int, "fdatasync", int); init(); if (*name(fd)) { int s = step("fsync", name(fd), 0, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(fd); if (s == 2) die(); return r; } return real(fd); }
int unlink(const char *p) { REAL(int, "unlink", const char*); init(); if (wanted(p)) { int s = step("unlink", p, 0, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(p); if (s == 2) die(); return r; } return real(p); }
int rename(const char *a, const char *b) { REAL(int, "rename", const char*, const char*); init(); if (wanted(a) || wanted(b)) { int s = step("rename", b, 0, 0, 0); if (s < 0) { errno = -s; return -1; } if (s == 1) die(); int r = real(a, b); if (s == 2) die(); return r; } return real(a, b); }
int flock(int fd, int op) { REAL(int, "flock", int, int); init(); if (flock_errno) { errno = flock_errno; return -1; } return real(fd, op); }
