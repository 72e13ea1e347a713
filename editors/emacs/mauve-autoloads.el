;;; mauve-autoloads.el --- Loads mauve.el for the files that need it  -*- lexical-binding: t; no-byte-compile: t -*-

;; Emacs loads this file when it starts.

;;; Code:

(add-to-list 'load-path (directory-file-name (file-name-directory load-file-name)))

(defvar mauve-program "mauve")

(autoload 'mauve-mode "mauve" "Major mode for MAUVE models." t)
(autoload 'mauve-toml-mode "mauve" "Major mode for the configuration and the timing table of a MAUVE project." t)
(autoload 'mauve-yaml-mode "mauve" "Major mode for the threads of an executor of ROS 2." t)
(autoload 'mauve-recognise "mauve" "Select the major mode of a `.mal' file by its content.")
(autoload 'mauve-recognise-yaml "mauve" "Select the major mode of a `threads.yaml': other projects may have one.")
(autoload 'mauve-command "mauve" "Run `mauve' in the folder of the project." t)

(add-to-list 'auto-mode-alist '("\\.mal\\'" . mauve-recognise))
(add-to-list 'auto-mode-alist '("/\\(?:mauve\\|timing\\)\\.toml\\'" . mauve-toml-mode))
(add-to-list 'auto-mode-alist '("/threads\\.ya?ml\\'" . mauve-recognise-yaml))

(provide 'mauve-autoloads)

;;; mauve-autoloads.el ends here
