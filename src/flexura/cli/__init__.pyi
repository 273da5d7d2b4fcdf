from flexura.cli.app import main as main
