;; -*- no-byte-compile: t; lexical-binding: nil -*-
(define-package "mauve" "0.1.0" "Response times of robots that are described in MAUVE" '((emacs "29.1")))
