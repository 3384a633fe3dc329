/* A disk that hangs or fails: preloaded into the server, it makes what changes files wait for as long as a control file
 * is there. The file says which paths are meant: those that hold its text. Where the text begins with an exclamation
 * mark, every seventh operation on such a path fails at once instead. Reading goes on, as from a cache. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

enum hindrance { NONE, WAIT, FAIL };

static enum hindrance hindrance_of(const char *path) {
    char text[512];
    const char *control = getenv("STUCK_DISK_CONTROL"), *folder = getenv("STUCK_DISK_FOLDER");
    if (control == NULL || folder == NULL || strncmp(path, folder, strlen(folder)) != 0) return NONE;
    int fd = (int)syscall(SYS_openat, AT_FDCWD, control, O_RDONLY | O_CLOEXEC, 0);
    if (fd < 0) return NONE;
    ssize_t bytes = syscall(SYS_read, fd, text, sizeof text - 1);
    syscall(SYS_close, fd);
    if (bytes < 0) return NONE;
    text[bytes] = 0;
    int fails = text[0] == '!';
    if (strstr(path + strlen(folder), text + fails) == NULL) return NONE;
    return fails ? FAIL : WAIT;
}

/* Waits, and says so by a file beside the control file; or tells that the operation is to fail. */
static int path_fails(const char *path) {
    static atomic_uint operations;
    struct timespec moment = {0, 5000000};
    enum hindrance hindrance = hindrance_of(path);
    if (hindrance == FAIL && atomic_fetch_add(&operations, 1) % 7 == 6) {
        errno = EIO;
        return 1;
    }
    if (hindrance != WAIT) return 0;
    char waits[4096];
    snprintf(waits, sizeof waits, "%s.waits", getenv("STUCK_DISK_CONTROL"));
    int fd = (int)syscall(SYS_openat, AT_FDCWD, waits, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd >= 0) syscall(SYS_close, fd);
    while (hindrance_of(path) == WAIT) nanosleep(&moment, NULL);
    return 0;
}

static int file_fails(int fd) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t bytes = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
    if (bytes <= 0) return 0;
    path[bytes] = 0;
    return path[0] == '/' && path_fails(path);
}

/* That of `path` below the folder that `dirfd` is. */
static int entry_fails(int dirfd, const char *path) {
    return dirfd == AT_FDCWD || path[0] == '/' ? path_fails(path) : file_fails(dirfd);
}

#define REAL(type, name) static type (*real)(); if (real == NULL) real = (type (*)())dlsym(RTLD_NEXT, name)
#define OF_FILE(type, name, parameters, arguments) \
    type name parameters { REAL(type, #name); return file_fails(fd) ? -1 : real arguments; }
#define OF_PATH(type, name, parameters, arguments) \
    type name parameters { REAL(type, #name); return path_fails(path) ? -1 : real arguments; }

OF_FILE(ssize_t, write, (int fd, const void *bytes, size_t count), (fd, bytes, count))
OF_FILE(ssize_t, writev, (int fd, const struct iovec *parts, int count), (fd, parts, count))
OF_FILE(ssize_t, pwrite, (int fd, const void *bytes, size_t count, off_t at), (fd, bytes, count, at))
OF_FILE(ssize_t, pwrite64, (int fd, const void *bytes, size_t count, off64_t at), (fd, bytes, count, at))
OF_FILE(int, fsync, (int fd), (fd))
OF_FILE(int, fdatasync, (int fd), (fd))
OF_FILE(int, ftruncate, (int fd, off_t bytes), (fd, bytes))
OF_FILE(int, ftruncate64, (int fd, off64_t bytes), (fd, bytes))
OF_PATH(int, rename, (const char *path, const char *to), (path, to))
OF_PATH(int, unlink, (const char *path), (path))
OF_PATH(int, rmdir, (const char *path), (path))
OF_PATH(int, mkdir, (const char *path, mode_t mode), (path, mode))

int renameat(int dirfd, const char *path, int to_dirfd, const char *to) {
    REAL(int, "renameat");
    return entry_fails(dirfd, path) ? -1 : real(dirfd, path, to_dirfd, to);
}

int unlinkat(int dirfd, const char *path, int flags) {
    REAL(int, "unlinkat");
    return entry_fails(dirfd, path) ? -1 : real(dirfd, path, flags);
}

#define OPEN(name, before, names, dirfd) \
    int name(before const char *path, int flags, ...) { \
        REAL(int, #name); \
        mode_t mode = 0; \
        if ((flags & O_CREAT) || (flags & O_TMPFILE) == O_TMPFILE) { \
            va_list more; \
            va_start(more, flags); \
            mode = va_arg(more, mode_t); \
            va_end(more); \
        } \
        if ((flags & (O_CREAT | O_TRUNC)) && entry_fails(dirfd, path)) return -1; \
        return real(names path, flags, mode); \
    }
#define NOTHING
#define BEFORE int dirfd,
#define NAME dirfd,
OPEN(open, NOTHING, NOTHING, AT_FDCWD)
OPEN(open64, NOTHING, NOTHING, AT_FDCWD)
OPEN(openat, BEFORE, NAME, dirfd)
OPEN(openat64, BEFORE, NAME, dirfd)
