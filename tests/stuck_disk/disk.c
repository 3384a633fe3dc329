/* A disk that hangs: preloaded into the server, it makes what changes files wait for as long as a control file is
 * there. The file says which paths are meant: those that hold its text. Reading goes on, as from a cache. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
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

static int is_meant(const char *path) {
    char text[512];
    const char *control = getenv("STUCK_DISK_CONTROL"), *folder = getenv("STUCK_DISK_FOLDER");
    if (control == NULL || folder == NULL || strncmp(path, folder, strlen(folder)) != 0) return 0;
    int fd = (int)syscall(SYS_openat, AT_FDCWD, control, O_RDONLY | O_CLOEXEC, 0);
    if (fd < 0) return 0;
    ssize_t bytes = syscall(SYS_read, fd, text, sizeof text - 1);
    syscall(SYS_close, fd);
    if (bytes < 0) return 0;
    text[bytes] = 0;
    return strstr(path + strlen(folder), text) != NULL;
}

/* Says so by a file beside the control file. */
static void wait_for_path(const char *path) {
    struct timespec moment = {0, 5000000};
    if (!is_meant(path)) return;
    char waits[4096];
    snprintf(waits, sizeof waits, "%s.waits", getenv("STUCK_DISK_CONTROL"));
    int fd = (int)syscall(SYS_openat, AT_FDCWD, waits, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (fd >= 0) syscall(SYS_close, fd);
    while (is_meant(path)) nanosleep(&moment, NULL);
}

static void wait_for_file(int fd) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t bytes = syscall(SYS_readlinkat, AT_FDCWD, link, path, sizeof path - 1);
    if (bytes <= 0) return;
    path[bytes] = 0;
    if (path[0] == '/') wait_for_path(path);
}

/* The path of `path` below the folder that `dirfd` is. */
static void wait_for_entry(int dirfd, const char *path) {
    if (dirfd == AT_FDCWD || path[0] == '/') wait_for_path(path);
    else wait_for_file(dirfd);
}

#define REAL(type, name) static type (*real)(); if (real == NULL) real = (type (*)())dlsym(RTLD_NEXT, name)
#define OF_FILE(type, name, parameters, arguments) \
    type name parameters { REAL(type, #name); wait_for_file(fd); return real arguments; }
#define OF_PATH(type, name, parameters, arguments) \
    type name parameters { REAL(type, #name); wait_for_path(path); return real arguments; }

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
    wait_for_entry(dirfd, path);
    return real(dirfd, path, to_dirfd, to);
}

int unlinkat(int dirfd, const char *path, int flags) {
    REAL(int, "unlinkat");
    wait_for_entry(dirfd, path);
    return real(dirfd, path, flags);
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
        if (flags & (O_CREAT | O_TRUNC)) wait_for_entry(dirfd, path); \
        return real(names path, flags, mode); \
    }
#define NOTHING
#define BEFORE int dirfd,
#define NAME dirfd,
OPEN(open, NOTHING, NOTHING, AT_FDCWD)
OPEN(open64, NOTHING, NOTHING, AT_FDCWD)
OPEN(openat, BEFORE, NAME, dirfd)
OPEN(openat64, BEFORE, NAME, dirfd)
