;; -*- no-byte-compile: t; lexical-binding: nil -*-
(define-package "mauve" "0.2.0" "Response times of robots that are described in MAUVE" '((emacs "29.1")))
